//! Draws a picture on a window or a canvas of any size.

#[cfg(doc)]
use super::Renderer;
use super::device::{Cover, Gpu};
use super::pass_clock::PassClock;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind;

/// Draws pictures on targets of one format.
#[derive(Debug)]
pub struct Present {
    gpu: Gpu,
    cover: Cover,
    smoothly: wgpu::Sampler,
}

impl Present {
    /// For targets of `format`: the preferred one of a surface. Values are encoded as sRGB, by the shader or by the format.
    pub fn new((device, queue): (&wgpu::Device, &wgpu::Queue), format: wgpu::TextureFormat) -> Self {
        let gpu = Gpu { device: device.clone(), queue: queue.clone() };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let cover = gpu.cover(("present", &source(format.is_srgb())), &[texture, sampler], format);
        let smoothly = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("present"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { gpu, cover, smoothly }
    }

    /// Stretches `picture` over `target`.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        picture: &wgpu::Texture,
        target: &wgpu::TextureView,
    ) {
        self.encode_timed(encoder, (picture, target), None);
    }

    /// Stretches the first texture over the second one; `clock` takes the times of the pass.
    pub fn encode_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (picture, target): (&wgpu::Texture, &wgpu::TextureView),
        clock: Option<&PassClock>,
    ) {
        let view = picture.create_view(&Default::default());
        let resources =
            [wgpu::BindingResource::TextureView(&view), wgpu::BindingResource::Sampler(&self.smoothly)];
        let group = bind::group(&self.gpu.device, "present", &self.cover.layout, resources);
        self.cover.encode(encoder, &group, target, clock);
    }
}

/// The shader; `target_encodes` means that the target's format converts linear values to sRGB.
pub(super) fn source(target_encodes: bool) -> String {
    format!("const TARGET_ENCODES: bool = {target_encodes};\n{}", include_str!("present.wgsl"))
}
