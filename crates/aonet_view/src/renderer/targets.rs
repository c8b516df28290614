//! The textures of a frame.

use super::device::Gpu;
use crate::Result;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind::extent;
use aonet::{Size, Window};
use wgpu::TextureFormat as Format;

/// A texture and a view of all of it.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
}

/// The textures of the G-buffer, which cover the picture and its guard band, and the finished picture.
#[derive(Debug)]
pub(super) struct Targets {
    pub(super) window: Window,
    /// View-space unit shading normals towards the viewer; zero on the background.
    pub(super) normal: Target,
    /// Distance along -Z (world units); 0 on the background.
    pub(super) depth: Target,
    /// Reflectance.
    pub(super) albedo: Target,
    /// View-space unit normals of the triangles towards the viewer; zero on the background.
    pub(super) geo_normal: Target,
    /// None until a frame shows it.
    pub(super) second: Option<SecondTargets>,
    /// Depth for hidden-surface removal.
    pub(super) z: Target,
    /// sRGB values; without the guard band.
    pub(super) picture: Target,
}

/// The textures of the second layer.
#[derive(Debug)]
pub(super) struct SecondTargets {
    /// As [`Targets::normal`].
    pub(super) normal: Target,
    /// As [`Targets::depth`].
    pub(super) depth: Target,
}

pub(super) const NORMAL: Format = Format::Rgba16Float;
pub(super) const DEPTH: Format = Format::R32Float;
pub(super) const ALBEDO: Format = Format::Rgba8UnormSrgb;
pub(super) const Z: Format = Format::Depth32Float;
pub(super) const PICTURE: Format = Format::Rgba8Unorm;
/// A step is 5e-4 at most; with 8 bits, steps would be visible in errors.
pub(super) const VISIBILITY: Format = Format::R16Float;
pub(super) const BENT: Format = Format::Rgba16Float;

impl Targets {
    pub(super) fn new(gpu: &Gpu, window: Window) -> Self {
        let target = |format| Target::new(gpu, window.buffer_size(), format);
        Self {
            window,
            normal: target(NORMAL),
            depth: target(DEPTH),
            albedo: target(ALBEDO),
            geo_normal: target(NORMAL),
            second: None,
            z: target(Z),
            picture: Target::new(gpu, window.size(), PICTURE),
        }
    }
}

impl SecondTargets {
    pub(super) fn new(gpu: &Gpu, window: Window) -> Self {
        let target = |format| Target::new(gpu, window.buffer_size(), format);
        Self { normal: target(NORMAL), depth: target(DEPTH) }
    }
}

impl Target {
    pub(super) fn new(gpu: &Gpu, size: Size, format: Format) -> Self {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("aonet_view"),
            size: extent(size),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        Self { texture, view }
    }
}

/// Checks that the device has textures for a picture and its guard band.
///
/// # Errors
/// When a side is too large.
pub(super) fn check_size(gpu: &Gpu, window: Window) -> Result<()> {
    let most = gpu.device.limits().max_texture_dimension_2d as usize;
    let size = window.buffer_size();
    if size.width().max(size.height()) <= most {
        return Ok(());
    }
    let expected = format!("width and height in 1..={most}");
    Err(aonet::Error::size("frames of a renderer", expected, size).into())
}
