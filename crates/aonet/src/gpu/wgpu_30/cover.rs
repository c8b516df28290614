//! Render passes that cover their target: how shaders write formats of which few can be written otherwise.

use crate::gpu::image::covering;
use crate::gpu::wgpu_30::bind;

/// A pipeline of one triangle that covers its target of `format`; `main` of the source, of which this adds the vertex stage
/// `cover`, gives a pixel its value. To be drawn with three vertices.
pub fn cover_pipeline(
    device: &wgpu::Device,
    (label, source): (&str, &str),
    groups: &[&wgpu::BindGroupLayout],
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    covered_pipeline(device, (label, &covering(source)), groups, format)
}

/// The same for a source with its vertex stage.
pub(crate) fn covered_pipeline(
    device: &wgpu::Device,
    (label, source): (&str, &str),
    groups: &[&wgpu::BindGroupLayout],
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let module = bind::module(device, label, source);
    let layout = bind::pipeline_layout(device, label, groups);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("cover"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A target that is cleared to `colour` and kept.
pub fn cleared(view: &wgpu::TextureView, colour: wgpu::Color) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(colour), store: wgpu::StoreOp::Store },
    })
}
