//! The AO texture: a render pass, because few formats of one channel can be written by other shaders.

use crate::error::Result;
use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::cover::cover_pipeline;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, group, layout};

/// What the image is made of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Raw<'a> {
    /// One value a pixel, pixel of the patch by pixel.
    Pixels(&'a wgpu::Buffer),
    /// The first channel of blocks of four.
    FirstChannel(&'a wgpu::Buffer),
}

/// The last pass.
#[derive(Debug)]
pub(crate) struct Image {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Image {
    /// # Errors
    /// Never.
    pub(crate) fn new(
        (context, options): (&Context, &Options),
        compiler: &Compiler,
        raw: Raw<'_>,
        (patch, cells, base): (usize, (usize, usize), Option<&wgpu::Buffer>),
        corrects: bool,
    ) -> Result<Self> {
        let (Raw::Pixels(buffer) | Raw::FirstChannel(buffer)) = raw;
        let blocked = matches!(raw, Raw::FirstChannel(_));
        let shader = shader((context.precision, options), patch, [corrects, blocked]);
        let size = context.uniform("image", &[cells.0, cells.1])?;
        let base = base.unwrap_or(buffer);
        let bindings = [Binding::Uniform(&size), Binding::Read(buffer), Binding::Read(base)];
        let own = layout(&context.device, "image", wgpu::ShaderStages::FRAGMENT, &bindings);
        let groups = [&compiler.view_layout, &own];
        let pipeline = cover_pipeline(&context.device, ("image", shader.source()), &groups, options.output);
        Ok(Self { pipeline, group: group(&context.device, "image", &own, &bindings) })
    }

    pub(crate) fn encode(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, view, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The shader of the image; whether it corrects a horizon search, and whether it reads blocks of four channels.
pub(crate) fn shader(of: (Precision, &Options), patch: usize, [corrects, blocked]: [bool; 2]) -> Shader {
    let (ty, first) = if blocked { ("real4", ".x") } else { ("f32", "") };
    surface(of.0, of.1)
        .number("PATCH", patch)
        .flag("CORRECTION", corrects)
        .part(&include_str!("image.wgsl").replace("RAW", ty).replace("FIRST_CHANNEL", first))
}
