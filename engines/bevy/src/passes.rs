//! Two passes around a session: one cuts a viewport out of the prepass, one raises visibility to a power.

use aonet::gpu::wgpu;
use bevy::prelude::*;
use bevy::render::renderer::RenderDevice;

/// Format of a viewport's normals: that of Bevy's prepass.
pub const NORMALS: wgpu::TextureFormat = bevy::core_pipeline::prepass::NORMAL_PREPASS_FORMAT;
/// Format of a viewport's depth.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// Bytes of `Numbers` in the shader.
const BYTES: u64 = 16;

/// The passes of a device.
#[derive(Resource, Debug)]
pub struct Passes {
    device: wgpu::Device,
    module: wgpu::ShaderModule,
    layout: wgpu::BindGroupLayout,
    crop: wgpu::RenderPipeline,
}

/// The pass that raises visibility to a power, for one format.
#[derive(Debug)]
pub struct Strengthen(wgpu::RenderPipeline);

impl FromWorld for Passes {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>().wgpu_device().clone();
        let module = device.create_shader_module(wgpu::include_wgsl!("passes.wgsl"));
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: wgpu::BufferSize::new(BYTES),
        };
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("aonet"),
            entries: &[(0, uniform), (1, texture), (2, texture)].map(entry),
        });
        let crop = pipeline(&device, &module, &layout, "crop", &[NORMALS, DEPTH]);
        Self { device, module, layout, crop }
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    entry: &str,
    formats: &[wgpu::TextureFormat],
) -> wgpu::RenderPipeline {
    let targets: Vec<_> = formats.iter().map(|format| Some((*format).into())).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("cover"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

impl Passes {
    /// The pass for visibility of a format.
    pub fn strengthen(&self, format: wgpu::TextureFormat) -> Strengthen {
        Strengthen(pipeline(&self.device, &self.module, &self.layout, "strengthen", &[format]))
    }

    /// Encodes a copy of the viewport at `corner` (px) from normals and depth of a target to `to`.
    pub fn encode_crop(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        corner: UVec2,
        from: [&wgpu::TextureView; 2],
        to: [&wgpu::TextureView; 2],
    ) {
        self.encode(encoder, (&self.crop, "aonet crop"), self.group(corner, 1.0, from), &to);
    }

    /// Encodes visibility to the power of `intensity`.
    pub fn encode_strengthen(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        Strengthen(pipeline): &Strengthen,
        intensity: f32,
        from: &wgpu::TextureView,
        to: &wgpu::TextureView,
    ) {
        let group = self.group(UVec2::ZERO, intensity, [from, from]);
        self.encode(encoder, (pipeline, "aonet strengthen"), group, &[to]);
    }

    fn group(&self, corner: UVec2, intensity: f32, from: [&wgpu::TextureView; 2]) -> wgpu::BindGroup {
        let buffer = numbers_buffer(&self.device, &[corner.x, corner.y, intensity.to_bits(), 0]);
        let [first, second] = from.map(wgpu::BindingResource::TextureView);
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("aonet"),
            layout: &self.layout,
            entries: &[(0, buffer.as_entire_binding()), (1, first), (2, second)]
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }),
        })
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (pipeline, label): (&wgpu::RenderPipeline, &str),
        group: wgpu::BindGroup,
        to: &[&wgpu::TextureView],
    ) {
        let targets: Vec<_> = to.iter().map(|view| Some(cleared(view, wgpu::Color::BLACK))).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &targets,
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// A uniform buffer of some words.
pub fn numbers_buffer(device: &wgpu::Device, words: &[u32]) -> wgpu::Buffer {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("aonet numbers"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::UNIFORM,
        mapped_at_creation: true,
    });
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.copy_from_slice(&bytes);
    }
    buffer.unmap();
    buffer
}

/// Encodes open visibility everywhere.
pub fn encode_open(encoder: &mut wgpu::CommandEncoder, to: &wgpu::TextureView) {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("aonet open"),
        color_attachments: &[Some(cleared(to, wgpu::Color::WHITE))],
        ..Default::default()
    });
}

fn cleared(view: &wgpu::TextureView, colour: wgpu::Color) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(colour), store: wgpu::StoreOp::Store },
    }
}
