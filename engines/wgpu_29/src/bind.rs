//! Buffers, groups and layouts.

use aonet::gpu::program::Binding;
use aonet::{Error, Result};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// A texture that is read texel by texel, depth too.
pub(crate) const TEXTURE: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Float { filterable: false },
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

pub(crate) const UNIFORM: wgpu::BindingType = buffer(wgpu::BufferBindingType::Uniform);

const fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// How a shader sees a buffer.
pub(crate) fn ty(binding: Binding) -> wgpu::BindingType {
    match binding {
        Binding::Uniform(_) => UNIFORM,
        Binding::Read(_) => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        Binding::Write(_) => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
    }
}

pub(crate) fn empty(
    device: &wgpu::Device,
    label: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// The layout of bindings that are numbered in order.
pub(crate) fn layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    types: impl Iterator<Item = wgpu::BindingType>,
) -> wgpu::BindGroupLayout {
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aonet"),
        entries: &entries,
    })
}

pub(crate) fn group<'a>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: impl Iterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("aonet"), layout, entries: &entries })
}

pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("aonet"),
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

/// What `make` returns, or what the device has against it.
pub(crate) fn scoped<T>(device: &wgpu::Device, what: &str, make: impl FnOnce() -> T) -> Result<T> {
    use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
    let scopes = [Validation, OutOfMemory, Internal].map(|filter| device.push_error_scope(filter));
    let made = make();
    let pop = |scope: wgpu::ErrorScopeGuard| match pin!(scope.pop())
        .poll(&mut Context::from_waker(Waker::noop()))
    {
        Poll::Ready(error) => error,
        Poll::Pending => None,
    };
    // All are popped, the innermost first.
    match scopes.into_iter().rev().map(pop).fold(None, Option::or) {
        Some(error) => Err(Error::device(what, "what the device accepts", error)),
        None => Ok(made),
    }
}
