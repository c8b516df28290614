//! Shaders whose first binding holds the parameters of a dispatch.

use aonet::gpu::wgpu;
use aonet::internals::gpu::bind;

/// Bytes of a dispatch's parameters that a shader can read: more than any of them has.
const NUMBERS_BYTES: std::num::NonZeroU64 = std::num::NonZeroU64::new(128).expect("not 0");

/// A group of buffers; the first one holds the parameters.
pub(super) fn group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    numbers: &wgpu::Buffer,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let numbers = wgpu::BufferBinding { buffer: numbers, offset: 0, size: Some(NUMBERS_BYTES) };
    let first = std::iter::once(wgpu::BindingResource::Buffer(numbers));
    bind::group(device, label, layout, first.chain(buffers.iter().map(|buffer| buffer.as_entire_binding())))
}

/// The function `main` of a shader.
pub(super) fn compute(
    device: &wgpu::Device,
    (label, source): (&str, &str),
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&bind::pipeline_layout(device, label, groups)),
        module: &bind::module(device, label, source),
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    })
}
