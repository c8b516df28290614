//! Bind groups, pipeline layouts and buffers, for everything that draws or computes beside the sessions.

use crate::error::{Error, Result};
use crate::frame::size::Size;

/// A texture that is read texel by texel. Depth textures, too, can be read as floats that are not filtered.
pub const TEXTURE: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Float { filterable: false },
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

/// A small buffer of numbers that all invocations read.
pub const UNIFORM: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform, false);

/// The same at an offset that is chosen when a pass is encoded.
pub const UNIFORM_AT_OFFSET: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform, true);

/// An array that shaders read.
pub const READ: wgpu::BindingType = buffer(wgpu::BufferBindingType::Storage { read_only: true }, false);

/// An array that shaders write.
pub const WRITE: wgpu::BindingType = buffer(wgpu::BufferBindingType::Storage { read_only: false }, false);

const fn buffer(ty: wgpu::BufferBindingType, has_dynamic_offset: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None }
}

/// The layout of a group of these bindings, numbered in order, for these stages.
pub fn layout(
    device: &wgpu::Device,
    label: &str,
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
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group of these resources, numbered in order.
pub fn group<'a>(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// The layout of a pipeline that sees these groups, numbered in order.
pub fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// A module of a WGSL source, with all checks.
pub fn module(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// A buffer that is written by shaders or from here, and can be copied from.
///
/// # Errors
/// When it is larger than a shader of the device may see.
pub fn checked_buffer(
    device: &wgpu::Device,
    label: &str,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer> {
    let limits = device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if bytes > most {
        let expected = format!("at most {most} bytes, which is the limit of the device");
        return Err(Error::device(format!("buffer of {label}"), expected, format!("{bytes} bytes")));
    }
    Ok(device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes,
        usage: usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}

/// The extent of a texture of two dimensions.
pub fn extent(size: Size) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.width() as u32, height: size.height() as u32, depth_or_array_layers: 1 }
}
