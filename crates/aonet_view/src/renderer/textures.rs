//! The images of a scene in the device's memory: layers of one array, all of one size, with all levels.

use super::decode::{self, Levels};
use super::device::Gpu;
use crate::Result;
use aonet::gpu::wgpu;
use aonet::internals::gpu::scoped;
use aonet_scene::scene::textures::{Decal, Image, Textures, Wrap};
use rayon::prelude::*;

/// Memory of all layers with their levels (bytes).
// guess: a tenth of what a small graphics card has. Forty-eight images of 1024 x 1024 fit in, or twelve of 2048.
const BUDGET_BYTES: u64 = 1 << 28;

/// Largest side of a layer (px). guess: above it a texel is smaller than a pixel in most frames.
const MOST_SIDE: u32 = 4096;

/// Images that are decoded at a time, one a core.
// guess: as many cores as most machines have. Each decodes one image of any size.
const AT_ONCE: usize = 8;

/// Most characters of a message about an image in a panel, because files choose the names of their images.
const MOST_CHARACTERS: usize = 300;

/// The [`number`] of a triangle without an image.
const NONE: u32 = u32::MAX;

/// Bytes of the struct `Decal` of `gbuffer.wgsl`.
const DECAL_BYTES: usize = 32;

/// Images, and the image of every triangle.
#[derive(Debug)]
pub(super) struct TextureArray {
    pub(super) view: wgpu::TextureView,
    /// A `Decal` for every triangle; a single one if no triangle has an image.
    pub(super) decals: wgpu::Buffer,
    /// Messages about images that are not shown.
    pub(super) missing: Vec<String>,
}

impl TextureArray {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(gpu: &Gpu, textures: &Textures) -> Result<Self> {
        let limits = gpu.device.limits();
        let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let (images, decals) = match textures.decal.len() as u64 * DECAL_BYTES as u64 <= most_bytes {
            true => (&textures.image[..], &textures.decal[..]),
            false => (&[][..], &[][..]),
        };
        let dropped = textures.image.len() > images.len();
        let mut missing: Vec<String> = dropped
            .then(|| "more triangles with images than the device has room for".into())
            .into_iter()
            .collect();
        let layers = images.len().clamp(1, limits.max_texture_array_layers as usize);
        let (own, shared) = images.split_at(if images.len() > layers { layers - 1 } else { images.len() });
        missing.extend(shared.iter().map(|image| format!("{}: more than {layers} images", image.name)));
        let side = side(own, limits.max_texture_dimension_2d);
        let decals = decal_bytes(decals, layers);
        Ok(scoped(&gpu.device, "textures", || {
            let texture = texture(gpu, side, layers);
            let plain = (own.len() < layers).then(|| decode::plain(side));
            plain.iter().for_each(|levels| upload(gpu, &texture, levels, layers - 1));
            missing.extend(fill(gpu, &texture, own));
            let buffer = gpu.buffer("decals", decals.len() as u64, wgpu::BufferUsages::STORAGE);
            gpu.queue.write_buffer(&buffer, 0, &decals);
            let view = texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            });
            Ok(Self { view, decals: buffer, missing })
        })?)
    }
}

/// The first missing image and the number of others, for a panel.
pub(super) fn sentence(missing: &[String]) -> Option<String> {
    let first: String = missing.first()?.chars().take(MOST_CHARACTERS).collect();
    let others = match missing.len() - 1 {
        0 => String::new(),
        others => format!(" (and {others} more)"),
    };
    Some(format!("not shown: {first}{others}"))
}

/// Decodes images into their layers; returns messages about those that cannot be decoded.
fn fill(gpu: &Gpu, texture: &wgpu::Texture, images: &[Image]) -> Vec<String> {
    let (mut missing, side) = (Vec::new(), texture.width());
    for (chunk, first) in images.chunks(AT_ONCE).zip((0..).step_by(AT_ONCE)) {
        let decoded: Vec<_> = chunk.par_iter().map(|image| decode::levels(image, side)).collect();
        for ((image, levels), layer) in chunk.iter().zip(decoded).zip(first..) {
            let levels = levels.unwrap_or_else(|why| {
                missing.push(format!("{}: {why}", image.name));
                decode::plain(side)
            });
            upload(gpu, texture, &levels, layer);
        }
        // Submits these writes, so that staging memory does not grow.
        gpu.queue.submit([]);
    }
    missing
}

/// Side of the layers (px): a power of two not below the largest image, or the largest that the budget allows.
fn side(images: &[Image], most: u32) -> u32 {
    let sizes = images.iter().filter_map(|image| decode::size(image).ok());
    let largest = sizes.map(|(width, height)| width.max(height)).max().unwrap_or(1);
    let mut side = largest.clamp(1, most.min(MOST_SIDE)).next_power_of_two();
    let bytes = |side: u32| images.len() as u64 * u64::from(side).pow(2) * 4 * 4 / 3;
    while side > 1 && (bytes(side) > BUDGET_BYTES || side > most) {
        side /= 2;
    }
    side
}

fn texture(gpu: &Gpu, side: u32, layers: usize) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("textures"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers as u32 },
        mip_level_count: side.ilog2() + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn upload(gpu: &Gpu, texture: &wgpu::Texture, levels: &Levels, layer: usize) {
    for (level, mip_level) in levels.iter().zip(0..) {
        let (width, height) = level.dimensions();
        let to = wgpu::TexelCopyTextureInfo {
            mip_level,
            origin: wgpu::Origin3d { x: 0, y: 0, z: layer as u32 },
            ..texture.as_image_copy()
        };
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        gpu.queue.write_texture(to, level.as_raw(), layout, size);
    }
}

/// The structs `Decal` of the shader.
fn decal_bytes(decals: &[Option<Decal>], layers: usize) -> Vec<u8> {
    let none = [None];
    let decals = if decals.is_empty() { &none } else { decals };
    let mut bytes = Vec::with_capacity(decals.len() * DECAL_BYTES);
    for decal in decals {
        let uv = decal.map_or([[0.0; 2]; 3], |decal| decal.uv);
        let number = decal.map_or(NONE, |decal| number(&decal, layers));
        bytes.extend(uv.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend([number, 0].into_iter().flat_map(u32::to_le_bytes));
    }
    bytes
}

/// A decal's layer in the lower half, then the wrap modes along u and v, two bits each.
fn number(decal: &Decal, layers: usize) -> u32 {
    let bits = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    };
    let [along_u, along_v] = decal.wrap.map(bits);
    decal.image.min(layers as u32 - 1) | along_u << 16 | along_v << 18
}

/// Binding type of the array.
pub(super) const ARRAY: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Float { filterable: true },
    view_dimension: wgpu::TextureViewDimension::D2Array,
    multisampled: false,
};

/// Samplers that repeat along both axes, along u, along v, and along neither.
pub(super) fn samplers(gpu: &Gpu) -> [wgpu::Sampler; 4] {
    use wgpu::AddressMode::{ClampToEdge, Repeat};
    [[Repeat, Repeat], [Repeat, ClampToEdge], [ClampToEdge, Repeat], [ClampToEdge, ClampToEdge]].map(
        |[u, v]| {
            gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("textures"),
                address_mode_u: u,
                address_mode_v: v,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            })
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet_scene::scene::textures::ImageFile;
    use image::{ImageFormat, RgbImage};

    fn image(width: u32, height: u32) -> Image {
        let mut bytes = std::io::Cursor::new(Vec::new());
        RgbImage::new(width, height).write_to(&mut bytes, ImageFormat::Png).unwrap();
        Image { name: "test".into(), file: Ok(ImageFile::Embedded(bytes.into_inner().into())) }
    }

    #[test]
    fn missing_images_are_named_and_counted() {
        assert_eq!(sentence(&[]), None);
        assert_eq!(sentence(&["image 3: torn".into()]).unwrap(), "not shown: image 3: torn");
        let three = ["a", "b", "c"].map(String::from);
        assert_eq!(sentence(&three).unwrap(), "not shown: a (and 2 more)");
        let long = sentence(&["é".repeat(1 << 20)]).unwrap();
        assert!((100..1000).contains(&long.len()), "{}", long.len());
    }

    #[test]
    fn layers_are_as_large_as_the_largest_image_and_the_budget() {
        let broken = Image { name: "broken".into(), file: Ok(ImageFile::Embedded([1, 2, 3].into())) };
        assert_eq!(side(&[], 8192), 1);
        assert_eq!(side(std::slice::from_ref(&broken), 8192), 1);
        assert_eq!(side(&[image(3, 5), broken, image(30, 2)], 8192), 32);
        assert_eq!([side(&[image(64, 100)], 64), side(&[image(64, 100)], 100)], [64, 64]);
        let many = vec![image(1024, 1); 48];
        assert_eq!(side(&many, 8192), 1024);
        let more = vec![image(1024, 1); 49];
        assert_eq!(side(&more, 8192), 512);
    }
}
