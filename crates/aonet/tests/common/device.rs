//! A device and textures for the tests of the GPU runtime. Without a device a test says that it was skipped; with
//! `AONET_REQUIRE_GPU=1` it fails.
#![allow(dead_code, reason = "each test program uses some of it")]

use aonet::gpu::{
    DepthEncoding, Device, FrameNumbers, Kernels, Layers, NormalEncoding, NormalSpace, Options, Precision,
    wgpu,
};
use aonet::internals::gpu::bind::extent;
use aonet::{AoImage, AoParams, GBuffer, Size};

/// A device, or none, said so.
pub(crate) fn device() -> Option<Device> {
    match Device::wait_for() {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// Whether the device is a driver that computes on the CPU: then nothing rounds in ways of its own.
pub(crate) fn on_the_cpu(device: &Device) -> bool {
    device.adapter.device_type == wgpu::DeviceType::Cpu
}

/// Inputs of a session with the default encodings but linear depth.
pub(crate) struct Inputs {
    pub(crate) normal: wgpu::TextureView,
    pub(crate) depth: wgpu::TextureView,
    /// None for frames with one layer.
    pub(crate) second: Option<wgpu::TextureView>,
    pub(crate) frame: FrameNumbers,
}

pub(crate) fn inputs(device: &Device, gbuffer: &GBuffer, params: AoParams) -> Inputs {
    let size = gbuffer.size();
    let texels = gbuffer.normal().iter().flat_map(|n| [n[0], n[1], n[2], 0.0]);
    let normals: Vec<_> = texels.flat_map(f32::to_le_bytes).collect();
    let depths = |depth: &[f32]| {
        let texels: Vec<_> = depth.iter().flat_map(|d| d.to_le_bytes()).collect();
        filled(device, size, wgpu::TextureFormat::R32Float, &texels)
    };
    Inputs {
        normal: filled(device, size, wgpu::TextureFormat::Rgba32Float, &normals),
        depth: depths(gbuffer.depth()),
        second: gbuffer.second().map(|second| depths(&second.depth)),
        frame: FrameNumbers { camera: *gbuffer.camera(), far: f32::INFINITY, params },
    }
}

/// Of a session for them, in 32-bit floats from end to end.
pub(crate) const OPTIONS: Options = Options {
    precision: Precision::F32,
    kernels: Kernels::Plain,
    normals: NormalEncoding::Plain,
    normal_space: NormalSpace::View,
    depth: DepthEncoding::Linear,
    layers: Layers::One,
    output: wgpu::TextureFormat::R32Float,
};

/// A texture of a format that can be written, rendered to where the format allows it, and read back.
pub(crate) fn texture(
    device: &Device,
    size: Size,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// A texture that shaders read, with these texels.
pub(crate) fn filled(
    device: &Device,
    size: Size,
    format: wgpu::TextureFormat,
    texels: &[u8],
) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = texture(device, size, format, usage);
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some((texels.len() / size.height()) as u32),
        rows_per_image: None,
    };
    device.queue.write_texture(texture.as_image_copy(), texels, layout, extent(size));
    texture.create_view(&Default::default())
}

/// A texture that a session writes.
pub(crate) fn target(device: &Device, size: Size, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    texture(device, size, format, usage).create_view(&Default::default())
}

/// Submits what was encoded and reads a target of one channel back.
pub(crate) fn read(device: &Device, encoder: wgpu::CommandEncoder, target: &wgpu::TextureView) -> AoImage {
    let size = size_of(target.texture());
    let texels = read_texels(device, encoder, target);
    let value = |texel: &[u8]| match *texel {
        [v] => f32::from(v) / 255.0,
        [a, b] => half::f16::from_le_bytes([a, b]).to_f32(),
        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
        _ => panic!("one channel"),
    };
    let values = texels.chunks_exact(texels.len() / size.pixels()).map(value);
    AoImage::new(size, values.collect()).unwrap()
}

fn size_of(texture: &wgpu::Texture) -> Size {
    Size::px(texture.width() as usize, texture.height() as usize)
}

/// Submits what was encoded and reads the bytes of a target back.
pub(crate) fn read_texels(
    device: &Device,
    mut encoder: wgpu::CommandEncoder,
    target: &wgpu::TextureView,
) -> Vec<u8> {
    let texture = target.texture();
    let size = size_of(texture);
    let texel_bytes = texture.format().block_copy_size(None).unwrap() as usize;
    let row_bytes = (size.width() * texel_bytes).next_multiple_of(256);
    let back = device.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: (row_bytes * size.height()) as u64,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row_bytes as u32),
        rows_per_image: None,
    };
    let to = wgpu::TexelCopyBufferInfo { buffer: &back, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, extent(size));
    device.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., Result::unwrap);
    device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = back.get_mapped_range(..).unwrap();
    bytes.chunks_exact(row_bytes).flat_map(|row| row[..size.width() * texel_bytes].iter().copied()).collect()
}

/// A size that is too large for the textures of the device, unless the device has textures of every size.
pub(crate) fn too_large(device: &Device) -> Option<Size> {
    let most = device.device.limits().max_texture_dimension_2d as usize;
    Size::new(most + 1, 1).ok()
}
