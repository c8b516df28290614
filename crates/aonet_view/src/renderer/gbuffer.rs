//! The G-buffer passes: rasterisation with reversed depth. CPU twin: `aonet_scene::gbuffer`.
//!
//! The second layer is depth peeling by a least distance: the scene is drawn again, without fragments that are in front of
//! the first layer's depth plus that distance.

use super::device::{Gpu, bytes};
use super::frame::CheckedFrame;
use super::pass_clock::PassClock;
use super::scene::SceneBuffers;
use super::stopwatch::Stopwatch;
use super::targets::{self, SecondTargets, Target, Targets};
use super::textures;
use aonet::Camera;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind::{self, READ, TEXTURE, UNIFORM};
use aonet::internals::gpu::cleared;
use aonet_scene::scene::Bounds;
use glam::{Mat4, Vec3, Vec3A};

/// Bytes of the struct `Camera` of `gbuffer.wgsl`.
const CAMERA_BYTES: u64 = 112;

/// A near plane at 0 is moved here, in radii of the scene; reversed depth in floats is precise enough.
// guess: nearer than a surface that fills the picture.
const NEAR_IN_RADII: f32 = 1e-5;

/// Draws a scene into the targets.
#[derive(Debug)]
pub(super) struct GbufferPass {
    gpu: Gpu,
    first: wgpu::RenderPipeline,
    second: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    /// Layout of what only the second layer reads: the depth of the first one.
    second_layout: wgpu::BindGroupLayout,
    camera: wgpu::Buffer,
    samplers: [wgpu::Sampler; 4],
}

/// One drawing of the scene into these targets.
struct Layer<'a> {
    label: &'a str,
    pipeline: &'a wgpu::RenderPipeline,
    groups: &'a [&'a wgpu::BindGroup],
    colours: &'a [&'a Target],
    z: &'a Target,
}

impl GbufferPass {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let mut types = vec![UNIFORM, READ, READ, READ, READ, READ, textures::ARRAY];
        types.extend([sampler; 4]);
        let layout = bind::layout(&gpu.device, "G-buffer", wgpu::ShaderStages::VERTEX_FRAGMENT, &types);
        let second_layout =
            bind::layout(&gpu.device, "second layer", wgpu::ShaderStages::FRAGMENT, &[TEXTURE]);
        let module = bind::module(&gpu.device, "G-buffer", include_str!("gbuffer.wgsl"));
        let colours = [targets::NORMAL, targets::DEPTH, targets::ALBEDO, targets::NORMAL];
        let first = pipeline(gpu, (&module, "main"), &[&layout], &colours);
        let second = pipeline(gpu, (&module, "behind"), &[&layout, &second_layout], &colours[..2]);
        let camera = gpu.buffer("camera", CAMERA_BYTES, wgpu::BufferUsages::UNIFORM);
        let samplers = textures::samplers(gpu);
        Self { gpu: gpu.clone(), first, second, layout, second_layout, camera, samplers }
    }

    /// Draws the first layer, and the second one if the frame has it.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (scene, targets): (&SceneBuffers, &Targets),
        frame: &CheckedFrame,
        mut watch: Option<&mut Stopwatch>,
    ) {
        self.gpu.queue.write_buffer(&self.camera, 0, &camera_bytes(frame, &scene.bounds));
        let group = self.group(scene);
        let first = Layer {
            label: "G-buffer",
            pipeline: &self.first,
            groups: &[&group],
            colours: &[&targets.normal, &targets.depth, &targets.albedo, &targets.geo_normal],
            z: &targets.z,
        };
        first.encode(encoder, scene, watch.as_deref_mut());
        if let (Some(_), Some(second)) = (frame.separation_units, &targets.second) {
            self.encode_second(encoder, (scene, targets, second), &group, watch);
        }
    }

    fn encode_second(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (scene, targets, second): (&SceneBuffers, &Targets, &SecondTargets),
        group: &wgpu::BindGroup,
        watch: Option<&mut Stopwatch>,
    ) {
        let depth = [wgpu::BindingResource::TextureView(&targets.depth.view)];
        let of_first = bind::group(&self.gpu.device, "second layer", &self.second_layout, depth);
        let layer = Layer {
            label: "second layer",
            pipeline: &self.second,
            groups: &[group, &of_first],
            colours: &[&second.normal, &second.depth],
            z: &targets.z,
        };
        layer.encode(encoder, scene, watch);
    }

    /// What both layers read.
    fn group(&self, scene: &SceneBuffers) -> wgpu::BindGroup {
        let decals = &scene.textures.decals;
        let buffers = [&self.camera, &scene.position, &scene.normal, &scene.triangle, &scene.albedo, decals];
        let mut resources = buffers.map(wgpu::Buffer::as_entire_binding).to_vec();
        resources.push(wgpu::BindingResource::TextureView(&scene.textures.view));
        resources.extend(self.samplers.each_ref().map(wgpu::BindingResource::Sampler));
        bind::group(&self.gpu.device, "G-buffer", &self.layout, resources)
    }
}

impl Layer<'_> {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &SceneBuffers,
        watch: Option<&mut Stopwatch>,
    ) {
        let clock = watch.and_then(|watch| watch.pass(self.label));
        let colours: Vec<_> =
            self.colours.iter().map(|target| cleared(&target.view, wgpu::Color::TRANSPARENT)).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(self.label),
            color_attachments: &colours,
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.z.view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: clock.as_ref().map(PassClock::render),
            ..Default::default()
        });
        pass.set_pipeline(self.pipeline);
        for (group, i) in self.groups.iter().zip(0..) {
            pass.set_bind_group(i, *group, &[]);
        }
        pass.draw(0..scene.corners, 0..1);
    }
}

/// A pipeline that draws triangles with a fragment stage of the shader into targets of these formats.
fn pipeline(
    gpu: &Gpu,
    (module, fragment): (&wgpu::ShaderModule, &str),
    groups: &[&wgpu::BindGroupLayout],
    formats: &[wgpu::TextureFormat],
) -> wgpu::RenderPipeline {
    let layout = bind::pipeline_layout(&gpu.device, "G-buffer", groups);
    let targets: Vec<_> = formats.iter().map(|format| Some((*format).into())).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("G-buffer"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
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
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The struct `Camera` of the shader.
fn camera_bytes(frame: &CheckedFrame, bounds: &Bounds) -> Vec<u8> {
    let (camera, far) = (&frame.buffer_camera, frame.params.far);
    let near = match camera.near() {
        0.0 => NEAR_IN_RADII * bounds.radius().max(f32::MIN_POSITIVE),
        near => near,
    };
    let (width, height) = (camera.width() as f32, camera.height() as f32);
    let ([focal_x, focal_y], [x, y]) = (camera.focal_px(), camera.centre_px());
    let scale = [2.0 * focal_x / width, 2.0 * focal_y / height];
    let axis = [2.0 * x / width - 1.0, 1.0 - 2.0 * y / height];
    let (z_line, w_line) = match camera.is_perspective() {
        true if far.is_infinite() => ([0.0, near], [1.0, 0.0]),
        true => {
            let range = far - near;
            ([-near / range, near / range * far], [1.0, 0.0])
        }
        false => {
            let far = far.min(farthest(camera, bounds));
            ([-1.0 / (far - near), far / (far - near)], [0.0, 1.0])
        }
    };
    let view_from_world = Mat4::from(camera.view_from_world()).to_cols_array();
    let separation = frame.separation_units.unwrap_or(0.0);
    let vectors = view_from_world.into_iter().chain(scale).chain(z_line).chain(w_line).chain(axis);
    let mut all = bytes(vectors.chain([separation]));
    all.resize(CAMERA_BYTES as usize, 0);
    all
}

/// A distance along -Z beyond the scene (world units), because an orthographic camera has no plane at infinity.
fn farthest(camera: &Camera, bounds: &Bounds) -> f32 {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let world = Vec3::new(pick(0), pick(1), pick(2));
        -camera.view_from_world().transform_point3a(Vec3A::from(world)).z
    };
    let far = (0..8).map(corner).fold(f32::MIN, f32::max);
    // guess: beyond the rounding of a coordinate.
    let slack = 1e-3 * bounds.radius().max(camera.near());
    far.max(camera.near()) + slack.max(f32::MIN_POSITIVE)
}
