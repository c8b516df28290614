//! The passes of a program on a device, one after the other.

use crate::error::Result;
use crate::gpu::program::{Draw, Program};
use crate::gpu::wgpu_30::bind;
use crate::gpu::wgpu_30::cover::{cleared, covered_pipeline};
use crate::gpu::wgpu_30::host::{Host, Ready, bound, ty};
use crate::gpu::wgpu_30::options::Outputs;
use crate::gpu::wgpu_30::view::BoundFrame;

/// A program's buffers and passes on a device.
#[derive(Debug)]
pub(crate) struct Chain {
    /// These begin with zeros every frame.
    cleared: Vec<wgpu::Buffer>,
    /// Passes that compute.
    passes: Vec<Ready>,
    /// The pass that draws the AO texture.
    image: Image,
    /// The pass that draws bent normals.
    bent: Option<Image>,
}

/// A pass that draws a picture.
#[derive(Debug)]
struct Image {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

/// Where the passes of a frame write when they begin and end.
#[derive(Debug, Clone, Copy)]
pub struct Timestamps<'a> {
    /// Two queries for each of a session's `pass_labels`.
    pub queries: &'a wgpu::QuerySet,
}

impl Image {
    fn new(
        host: &Host,
        draw: &Draw,
        source: &str,
        buffers: &[wgpu::Buffer],
        output: wgpu::TextureFormat,
    ) -> Self {
        let types: Vec<_> = draw.bindings.iter().map(|binding| ty(*binding)).collect();
        let own = bind::layout(&host.device, "image", wgpu::ShaderStages::FRAGMENT, &types);
        let groups = [&host.frame_layout, &own];
        let pipeline = covered_pipeline(&host.device, ("image", source), &groups, output);
        Self { pipeline, group: bind::group(&host.device, "image", &own, bound(&draw.bindings, buffers)) }
    }

    /// Draws the target, which is cleared to a colour; `index` is that of the pass.
    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (target, colour): (&wgpu::TextureView, wgpu::Color),
        view: &BoundFrame,
        (timestamps, index): (Option<Timestamps<'_>>, usize),
    ) {
        let first = 2 * index as u32;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("aonet image"),
            color_attachments: &[cleared(target, colour)],
            timestamp_writes: timestamps.map(|t| wgpu::RenderPassTimestampWrites {
                query_set: t.queries,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &view.group, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl Chain {
    /// # Errors
    /// When a buffer is larger than a shader may see.
    pub(crate) fn new(host: &Host, program: &Program, output: Outputs) -> Result<Self> {
        let buffers = host.buffers(program.buffers())?;
        let cleared = program.buffers().iter().zip(&buffers).filter(|(described, _)| described.cleared);
        let image =
            |draw: &Draw, format| Image::new(host, draw, &program.shaders()[draw.shader], &buffers, format);
        let bent = program.bent.as_ref().zip(output.bent).map(|(draw, format)| image(draw, format));
        Ok(Self {
            cleared: cleared.map(|(_, buffer)| buffer.clone()).collect(),
            passes: host.passes(program, &buffers),
            image: image(&program.image, output.visibility),
            bent,
        })
    }

    /// Encodes a frame whose numbers are written; with timestamps, every pass on its own.
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundFrame,
        timestamps: Option<Timestamps<'_>>,
    ) {
        for buffer in &self.cleared {
            encoder.clear_buffer(buffer, 0, None);
        }
        match timestamps {
            None => self.encode_passes(encoder, view),
            Some(timestamps) => self.encode_each_pass(encoder, view, timestamps),
        }
        let first = self.passes.len();
        self.image.draw(encoder, (&view.visibility, wgpu::Color::WHITE), view, (timestamps, first));
        if let Some((bent, target)) = self.bent.as_ref().zip(view.bent.as_ref()) {
            bent.draw(encoder, (target, wgpu::Color::TRANSPARENT), view, (timestamps, first + 1));
        }
    }

    fn encode_passes(&self, encoder: &mut wgpu::CommandEncoder, view: &BoundFrame) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("aonet"),
            timestamp_writes: None,
        });
        self.passes.iter().for_each(|p| p.encode(&mut pass, &view.group));
    }

    fn encode_each_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundFrame,
        timestamps: Timestamps<'_>,
    ) {
        for (i, pass) in self.passes.iter().enumerate() {
            let mut one = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(&pass.label),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: timestamps.queries,
                    beginning_of_pass_write_index: Some(2 * i as u32),
                    end_of_pass_write_index: Some(2 * i as u32 + 1),
                }),
            });
            pass.encode(&mut one, &view.group);
        }
    }
}
