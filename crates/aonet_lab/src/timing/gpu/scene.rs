//! Textures of the timed frame, as in a renderer.

use crate::timing::{RADIUS, bump};
use aonet::gpu::{DepthEncoding, Device, FrameNumbers, FrameViews, Options, Precision, wgpu};
use aonet::internals::gpu::bind::extent;
use aonet::{AoParams, GBuffer, Size};
use aonet_scene::Result;
use half::f16;

/// Normals of 16 bits, linear depth of 32, AO of 8.
pub(super) fn options(precision: Precision) -> Options {
    Options { precision, depth: DepthEncoding::Linear, ..Options::default() }
}

/// The textures that a session reads and writes, and the frame.
pub(super) struct Scene {
    views: [wgpu::TextureView; 3],
    pub(super) frame: FrameNumbers,
}

impl Scene {
    /// The synthetic frame of all timings, at `size`.
    ///
    /// # Errors
    /// When the radius is out of range.
    pub(super) fn new(device: &Device, size: Size) -> Result<Self> {
        let gbuffer = bump(size)?;
        let normals = gbuffer.normal().iter().flat_map(|n| [n[0], n[1], n[2], 0.0].map(f16::from_f32));
        let depths = gbuffer.depth().iter().flat_map(|d| d.to_le_bytes());
        let textures = [
            filled(device, &gbuffer, wgpu::TextureFormat::Rgba16Float, normals.flat_map(f16::to_le_bytes)),
            filled(device, &gbuffer, wgpu::TextureFormat::R32Float, depths),
            texture(device, size, wgpu::TextureFormat::R8Unorm, wgpu::TextureUsages::RENDER_ATTACHMENT),
        ];
        Ok(Self {
            views: textures.map(|t| t.create_view(&Default::default())),
            frame: FrameNumbers {
                camera: *gbuffer.camera(),
                far: f32::INFINITY,
                params: AoParams::new(RADIUS)?,
            },
        })
    }

    pub(super) fn textures(&self) -> FrameViews<'_> {
        let [normal, depth, visibility] = &self.views;
        FrameViews { normal, depth, second: None, visibility }
    }
}

fn texture(
    device: &Device,
    size: Size,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("timed frame"),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn filled(
    device: &Device,
    of: &GBuffer,
    format: wgpu::TextureFormat,
    texels: impl Iterator<Item = u8>,
) -> wgpu::Texture {
    let (size, texels) = (of.size(), texels.collect::<Vec<_>>());
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = texture(device, size, format, usage);
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some((texels.len() / size.height()) as u32),
        rows_per_image: None,
    };
    device.queue.write_texture(texture.as_image_copy(), &texels, layout, extent(size));
    texture
}
