//! Shaders with the layout of their bindings.

use aonet::gpu::wgpu;

/// How a shader accesses a buffer, in the order of its bindings.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sees {
    /// The parameters of a dispatch, at an offset.
    Numbers,
    Read,
    Write,
}

/// The layout of a group of buffers.
pub(super) fn layout(
    device: &wgpu::Device,
    label: &str,
    stage: wgpu::ShaderStages,
    sees: &[Sees],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(sees)
        .map(|(binding, sees)| {
            let ty = match sees {
                Sees::Numbers => wgpu::BufferBindingType::Uniform,
                Sees::Read => wgpu::BufferBindingType::Storage { read_only: true },
                Sees::Write => wgpu::BufferBindingType::Storage { read_only: false },
            };
            wgpu::BindGroupLayoutEntry {
                binding,
                visibility: stage,
                ty: wgpu::BindingType::Buffer {
                    ty,
                    has_dynamic_offset: matches!(sees, Sees::Numbers),
                    min_binding_size: None,
                },
                count: None,
            }
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// Bytes of a dispatch's parameters that a shader can read: more than any of them has.
const NUMBERS_BYTES: std::num::NonZeroU64 = std::num::NonZeroU64::new(128).expect("not 0");

/// A group of buffers; the first one holds the parameters.
pub(super) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    numbers: &wgpu::Buffer,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let numbers = wgpu::BufferBinding { buffer: numbers, offset: 0, size: Some(NUMBERS_BYTES) };
    let first = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(numbers) };
    let others = (1..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
    let entries: Vec<_> = std::iter::once(first).chain(others).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A shader of its source.
fn module(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// The layout of the groups of a shader.
pub(super) fn pipeline_layout(
    device: &wgpu::Device,
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// The function `main` of a shader.
pub(super) fn compute(
    device: &wgpu::Device,
    (label, source): (&str, &str),
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&pipeline_layout(device, groups)),
        module: &module(device, label, source),
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    })
}
