//! Writes the AO texture by a render pass, because compute shaders can write few formats of one channel.

use super::memory::{Context, Ring};
use super::program;
use aonet::gpu::wgpu;
use aonet::internals::gpu::{bind, cleared, cover_pipeline};
use aonet::{Error, Result, Size};

/// The pass that divides open rays by rays.
#[derive(Debug)]
pub(super) struct Image {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    output: wgpu::TextureFormat,
}

/// The shader of it.
pub(super) const SOURCE: &str = include_str!("image.wgsl");

impl Image {
    pub(super) fn new(context: &Context, output: wgpu::TextureFormat) -> Self {
        let device = &context.device;
        let stage = wgpu::ShaderStages::FRAGMENT;
        let layout = bind::layout(device, "reference image", stage, &[bind::UNIFORM_AT_OFFSET, bind::READ]);
        let pipeline = cover_pipeline(device, ("reference image", SOURCE), &[&layout], output);
        Self { layout, pipeline, output }
    }

    pub(super) fn group(&self, context: &Context, ring: &Ring, open: &wgpu::Buffer) -> wgpu::BindGroup {
        program::group(&context.device, "reference image", &self.layout, &ring.buffer, &[open])
    }

    /// # Errors
    /// When the texture has another size or format, or cannot be rendered to.
    pub(super) fn check(&self, visibility: &wgpu::TextureView, size: Size) -> Result<()> {
        let texture = visibility.texture();
        check_size("visibility", texture, size)?;
        let (format, usage) = (texture.format(), texture.usage());
        if format != self.output {
            let expected = format!("{:?}", self.output);
            return Err(Error::value("visibility texture", expected, format!("{format:?}")));
        }
        if !usage.contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
            return Err(Error::value(
                "visibility texture's usage",
                "RENDER_ATTACHMENT",
                format!("{usage:?}"),
            ));
        }
        Ok(())
    }

    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        visibility: &wgpu::TextureView,
        (group, numbers): (&wgpu::BindGroup, u32),
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("reference image"),
            color_attachments: &[cleared(visibility, wgpu::Color::WHITE)],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[numbers]);
        pass.draw(0..3, 0..1);
    }
}

/// # Errors
/// When the texture has another size.
pub(super) fn check_size(what: &str, texture: &wgpu::Texture, size: Size) -> Result<()> {
    let found = Size::new(texture.width() as usize, texture.height() as usize)?;
    size.expect(&format!("{what} texture"), found)
}
