//! A device, and the objects that every pass creates on it.

use super::pass_clock::PassClock;
use aonet::gpu::wgpu;
use aonet::internals::gpu::{bind, cleared, cover_pipeline};

/// A device and its queue.
#[derive(Debug, Clone)]
pub(super) struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
}

/// A pass that covers its target; see [`cover_pipeline`].
#[derive(Debug)]
pub(super) struct Cover {
    pub(super) pipeline: wgpu::RenderPipeline,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl Gpu {
    /// A buffer of `bytes` that the CPU writes. `mapped_at_creation` would panic without enough memory.
    pub(super) fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// A [`Cover`] with these bindings.
    pub(super) fn cover(
        &self,
        shader: (&str, &str),
        types: &[wgpu::BindingType],
        format: wgpu::TextureFormat,
    ) -> Cover {
        let layout = bind::layout(&self.device, shader.0, wgpu::ShaderStages::FRAGMENT, types);
        let pipeline = cover_pipeline(&self.device, shader, &[&layout], format);
        Cover { pipeline, layout }
    }
}

impl Cover {
    /// Draws into `target`.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        group: &wgpu::BindGroup,
        target: &wgpu::TextureView,
        clock: Option<&PassClock>,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("aonet_view"),
            color_attachments: &[cleared(target, wgpu::Color::TRANSPARENT)],
            timestamp_writes: clock.map(PassClock::render),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Numbers as shaders read them.
pub(super) fn bytes(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}
