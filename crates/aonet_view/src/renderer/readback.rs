//! Copies frames from the device into main memory. Waits for the device.

use super::targets::Target;
use super::{Method, Renderer};
use crate::{Error, Result};
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind::extent;
use aonet::internals::gpu::scoped;
use aonet::{AoImage, Camera, GBuffer, SecondLayer};
use half::f16;
use image::RgbImage;

/// The output of the G-buffer passes, the guard band included.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Depth and shading normals, view space, with the second layer if the frame has one.
    pub gbuffer: GBuffer<'static>,
    /// HxW geometric normals, view space, towards the viewer; zero on the background.
    pub geo_normal: Vec<[f32; 3]>,
}

/// The last frame's picture: HxW texels of red, green, blue and alpha, sRGB.
///
/// # Errors
/// When the device is lost or has no memory for it.
pub fn picture(renderer: &Renderer) -> Result<Vec<u8>> {
    texels(renderer, renderer.picture())
}

/// The last frame's picture, without alpha.
///
/// # Errors
/// As [`picture`].
pub fn image(renderer: &Renderer) -> Result<RgbImage> {
    without_alpha(renderer, &picture(renderer)?)
}

/// The last frame's reflectance, sRGB; black on the background.
///
/// # Errors
/// As [`picture`].
pub fn albedo(renderer: &Renderer) -> Result<RgbImage> {
    let texels = texels(renderer, &renderer.targets.albedo.texture)?;
    let picture = renderer.window().cropped(texels.as_chunks::<4>().0.to_vec());
    without_alpha(renderer, picture.as_flattened())
}

fn without_alpha(renderer: &Renderer, texels: &[u8]) -> Result<RgbImage> {
    let size = renderer.size();
    let rgb = texels.as_chunks().0.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
    let missing = || Error::request("picture", "as many texels as the frame has", texels.len());
    RgbImage::from_raw(size.width() as u32, size.height() as u32, rgb).ok_or_else(missing)
}

/// The last frame's G-buffer. `camera` is the frame's camera.
///
/// # Errors
/// As [`picture`], and when the camera is of another size.
pub fn drawn(renderer: &Renderer, camera: &Camera) -> Result<Drawn> {
    let vectors = |target: &Target| Ok::<_, Error>(halves(&texels(renderer, &target.texture)?));
    let depths = |target: &Target| Ok::<_, Error>(distances(&texels(renderer, &target.texture)?));
    let (targets, margin) = (&renderer.targets, renderer.window().margin());
    let camera = camera.with_margin(margin)?;
    let gbuffer = GBuffer::new(camera, depths(&targets.depth)?, vectors(&targets.normal)?)?;
    let mut gbuffer = gbuffer.with_margin(margin)?;
    if let Some(second) = targets.second.as_ref().filter(|_| renderer.has_second) {
        let normal = Some(vectors(&second.normal)?.into());
        gbuffer = gbuffer.with_second(SecondLayer { depth: depths(&second.depth)?.into(), normal })?;
    }
    Ok(Drawn { gbuffer, geo_normal: vectors(&targets.geo_normal)? })
}

/// A method's visibility in the last frame.
///
/// # Errors
/// As [`picture`], and when the last frame did not show the method.
pub fn visibility(renderer: &Renderer, method: Method) -> Result<AoImage> {
    let size = renderer.size();
    let texture = &renderer.occlusion.visibility(method).texture;
    if texture.size() != extent(size) {
        return Err(Error::request("method", "one of the last frame", method));
    }
    let texels = texels(renderer, texture)?;
    let values = texels.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).to_f32());
    Ok(AoImage::new(size, values.collect())?)
}

/// A distance of each texel; infinite on the background.
fn distances(texels: &[u8]) -> Vec<f32> {
    let distance = |t: &[u8; 4]| match f32::from_le_bytes(*t) {
        0.0 => f32::INFINITY,
        distance => distance,
    };
    texels.as_chunks().0.iter().map(distance).collect()
}

/// The first three of four half floats of each texel.
fn halves(texels: &[u8]) -> Vec<[f32; 3]> {
    let vector = |t: &[u8; 8]| [0, 2, 4].map(|i| f16::from_le_bytes([t[i], t[i + 1]]).to_f32());
    texels.as_chunks().0.iter().map(vector).collect()
}

/// The texels of a texture, row by row.
fn texels(renderer: &Renderer, texture: &wgpu::Texture) -> Result<Vec<u8>> {
    let lost = |found: String| aonet::Error::device("texture", "one that can be read back", found);
    let gpu = &renderer.gpu;
    let texel_bytes = texture.format().block_copy_size(None).unwrap_or_default() as usize;
    let row_bytes = texture.width() as usize * texel_bytes;
    let padded = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
    Ok(scoped(&gpu.device, "read back", || {
        let bytes = (padded * texture.height() as usize) as u64;
        let back = gpu.buffer("read back", bytes, wgpu::BufferUsages::MAP_READ);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(padded as u32),
            rows_per_image: None,
        };
        let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
        gpu.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| ());
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(e.to_string()))?;
        let mapped = back.get_mapped_range(..).map_err(|e| lost(e.to_string()))?;
        Ok(mapped.chunks_exact(padded).flat_map(|row| &row[..row_bytes]).copied().collect())
    })?)
}
