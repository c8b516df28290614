//! The G-buffer pass: rasterisation with reversed depth. CPU twin: `aonet_scene::gbuffer`.

use super::device::{Gpu, bytes};
use super::frame::FrameParams;
use super::pass_clock::PassClock;
use super::scene::SceneBuffers;
use super::stopwatch::Stopwatch;
use super::targets::{self, Targets};
use super::textures;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind::{self, READ, UNIFORM};
use aonet::internals::gpu::cleared;
use aonet_scene::scene::Bounds;
use glam::{Mat4, Vec3, Vec3A};

/// Bytes of the struct `Camera` of `gbuffer.wgsl`.
const CAMERA_BYTES: u64 = 96;

/// A near plane at 0 is moved here, in radii of the scene; reversed depth in floats is precise enough.
// guess: nearer than a surface that fills the picture.
const NEAR_IN_RADII: f32 = 1e-5;

/// Draws a scene into the targets.
#[derive(Debug)]
pub(super) struct GbufferPass {
    gpu: Gpu,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    camera: wgpu::Buffer,
    samplers: [wgpu::Sampler; 4],
}

impl GbufferPass {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let mut types = vec![UNIFORM, READ, READ, READ, READ, READ, textures::ARRAY];
        types.extend([sampler; 4]);
        let layout = bind::layout(&gpu.device, "G-buffer", wgpu::ShaderStages::VERTEX_FRAGMENT, &types);
        let pipeline = pipeline(gpu, &layout);
        let camera = gpu.buffer("camera", CAMERA_BYTES, wgpu::BufferUsages::UNIFORM);
        Self { gpu: gpu.clone(), pipeline, layout, camera, samplers: textures::samplers(gpu) }
    }

    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (scene, targets): (&SceneBuffers, &Targets),
        frame: &FrameParams,
        watch: Option<&mut Stopwatch>,
    ) {
        self.gpu.queue.write_buffer(&self.camera, 0, &camera_bytes(frame, &scene.bounds));
        let decals = &scene.textures.decals;
        let buffers = [&self.camera, &scene.position, &scene.normal, &scene.triangle, &scene.albedo, decals];
        let mut resources = buffers.map(wgpu::Buffer::as_entire_binding).to_vec();
        resources.push(wgpu::BindingResource::TextureView(&scene.textures.view));
        resources.extend(self.samplers.each_ref().map(wgpu::BindingResource::Sampler));
        let group = bind::group(&self.gpu.device, "G-buffer", &self.layout, resources);
        let colours = [&targets.normal, &targets.depth, &targets.albedo, &targets.geo_normal];
        let clock = watch.and_then(|watch| watch.pass("G-buffer"));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("G-buffer"),
            color_attachments: &colours.map(|target| cleared(&target.view, wgpu::Color::TRANSPARENT)),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.z.view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: clock.as_ref().map(PassClock::render),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..scene.corners, 0..1);
    }
}

fn pipeline(gpu: &Gpu, group: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = bind::module(&gpu.device, "G-buffer", include_str!("gbuffer.wgsl"));
    let layout = bind::pipeline_layout(&gpu.device, "G-buffer", &[group]);
    let formats = [targets::NORMAL, targets::DEPTH, targets::ALBEDO, targets::NORMAL];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("G-buffer"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        // Both sides of a triangle are visible.
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: targets::Z,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            targets: &formats.map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The struct `Camera` of the shader.
fn camera_bytes(frame: &FrameParams, bounds: &Bounds) -> Vec<u8> {
    let camera = &frame.camera;
    let near = match camera.near() {
        0.0 => NEAR_IN_RADII * bounds.radius().max(f32::MIN_POSITIVE),
        near => near,
    };
    let (width, height) = (camera.width() as f32, camera.height() as f32);
    let ([focal_x, focal_y], [x, y]) = (camera.focal_px(), camera.centre_px());
    let scale = [2.0 * focal_x / width, 2.0 * focal_y / height];
    let axis = [2.0 * x / width - 1.0, 1.0 - 2.0 * y / height];
    let (z_line, w_line) = match camera.is_perspective() {
        true if frame.far.is_infinite() => ([0.0, near], [1.0, 0.0]),
        true => {
            let range = frame.far - near;
            ([-near / range, near / range * frame.far], [1.0, 0.0])
        }
        false => {
            let far = frame.far.min(farthest(frame, bounds));
            ([-1.0 / (far - near), far / (far - near)], [0.0, 1.0])
        }
    };
    let view_from_world = Mat4::from(camera.view_from_world()).to_cols_array();
    bytes(view_from_world.into_iter().chain(scale).chain(z_line).chain(w_line).chain(axis))
}

/// A distance along -Z beyond the scene (world units), because an orthographic camera has no plane at infinity.
fn farthest(frame: &FrameParams, bounds: &Bounds) -> f32 {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let world = Vec3::new(pick(0), pick(1), pick(2));
        -frame.camera.view_from_world().transform_point3a(Vec3A::from(world)).z
    };
    let far = (0..8).map(corner).fold(f32::MIN, f32::max);
    // guess: beyond the rounding of a coordinate.
    let slack = 1e-3 * bounds.radius().max(frame.camera.near());
    far.max(frame.camera.near()) + slack.max(f32::MIN_POSITIVE)
}
