//! A device, and the objects that every pass creates on it.

use super::pass_clock::PassClock;
use aonet::gpu::{cleared, cover_pipeline, wgpu};

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

    /// A bind group of these resources, in order.
    pub(super) fn group(
        &self,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources.iter().cloned()).map(entry).collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// A layout of these bindings, in order, for the stages.
    pub(super) fn layout(
        &self,
        stages: wgpu::ShaderStages,
        types: &[wgpu::BindingType],
    ) -> wgpu::BindGroupLayout {
        let entry = |(binding, ty): (u32, &wgpu::BindingType)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: stages,
            ty: *ty,
            count: None,
        };
        let entries: Vec<_> = (0..).zip(types).map(entry).collect();
        self.device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
    }

    /// A module and the pipeline layout of one group.
    pub(super) fn module(
        &self,
        (label, source): (&str, &str),
        group: &wgpu::BindGroupLayout,
    ) -> (wgpu::ShaderModule, wgpu::PipelineLayout) {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(group)],
            immediate_size: 0,
        });
        (module, layout)
    }

    /// A [`Cover`] with these bindings.
    pub(super) fn cover(
        &self,
        shader: (&str, &str),
        types: &[wgpu::BindingType],
        format: wgpu::TextureFormat,
    ) -> Cover {
        let layout = self.layout(wgpu::ShaderStages::FRAGMENT, types);
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

/// A texture that is read texel by texel.
pub(super) const TEXTURE: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Float { filterable: false },
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

/// A small buffer of numbers that all invocations see.
pub(super) const UNIFORM: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

/// Numbers as shaders read them.
pub(super) fn bytes(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}
