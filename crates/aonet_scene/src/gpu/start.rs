//! Start points of the rays.

use super::image::check_size;
use super::memory::{Context, Ring};
use super::program;
use super::scene::{self, SceneBuffers};
use crate::gbuffer::Surface;
use crate::reference::Point;
use crate::{Result, Scene};
use aonet::Size;
use aonet::gpu::{DepthEncoding, FrameNumbers, wgpu};
use aonet::internals::gpu::{LENS, LENS_WORDS, Lens, bind, scoped};
use glam::Vec3A;
use rayon::prelude::*;

/// A renderer's textures of a frame: of the reference's size, sampled once a pixel, with the usage
/// `TEXTURE_BINDING`.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceViews<'a> {
    /// Shading normals: x, y and z in view space (the camera looks along -Z), not encoded, of any length above zero:
    /// `Rgba16Float`, `Rgba32Float`.
    pub normal: &'a wgpu::TextureView,
    /// The triangles' own normals, likewise: rays below the surface are not open. If one points away from the camera, both
    /// normals are flipped.
    pub geo_normal: &'a wgpu::TextureView,
    /// Depth in the encoding of the options, the depth aspect only: `R32Float`, `Depth32Float`.
    pub depth: &'a wgpu::TextureView,
}

/// Textures that a [`Reference`](super::Reference) can start from.
#[derive(Debug)]
pub struct BoundTextures {
    size: Size,
    group: wgpu::BindGroup,
}

/// Bytes a pixel of each start buffer.
const POINT_BYTES: usize = 4 * size_of::<f32>();

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [16, 8];

/// Start points of an image: origin, normal, geometric normal; the normals are zero on the background.
#[derive(Debug)]
pub(super) struct Points {
    size: Size,
    pub(super) buffers: [wgpu::Buffer; 3],
    group: wgpu::BindGroup,
}

/// Where a pass writes start points, and the memory of its parameters.
pub(super) struct Destination<'a> {
    pub(super) context: &'a Context,
    pub(super) ring: &'a mut Ring,
    pub(super) points: &'a Points,
}

/// The pass that computes start points from textures.
#[derive(Debug)]
pub(super) struct Start {
    depth: DepthEncoding,
    layout: wgpu::BindGroupLayout,
    view_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// The shader of the pass.
pub(super) fn source(depth: DepthEncoding) -> String {
    let (encoding, farthest) = match depth {
        DepthEncoding::Linear => (0, "0.0"),
        DepthEncoding::Reversed => (1, "0.0"),
        DepthEncoding::Standard => (1, "1.0"),
    };
    let constants = format!(
        "const BACKGROUND: f32 = 1e16;\nconst LINEAR_DEPTH = 0;\nconst DEPTH = {encoding};\nconst FARTHEST = {farthest};\n"
    );
    scene::traverse() + &constants + LENS + include_str!("start.wgsl")
}

impl Start {
    pub(super) fn new(context: &Context, depth: DepthEncoding) -> Self {
        let device = &context.device;
        let (read, write) = (bind::READ, bind::WRITE);
        let types = [bind::UNIFORM_AT_OFFSET, read, read, write, write, write];
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = bind::layout(device, "start points", stage, &types);
        let view_layout = bind::layout(device, "view of a reference", stage, &[bind::TEXTURE; 3]);
        let pipeline = program::compute(device, ("start points", &source(depth)), &[&layout, &view_layout]);
        Self { depth, layout, view_layout, pipeline }
    }

    /// # Errors
    /// When a texture is of another size than `size`, or of a format or usage that cannot be read.
    pub(super) fn view(
        &self,
        context: &Context,
        size: Size,
        textures: SurfaceViews<'_>,
    ) -> aonet::Result<BoundTextures> {
        let SurfaceViews { normal, geo_normal, depth } = textures;
        let named = [("normal", normal), ("geometric normal", geo_normal), ("depth", depth)];
        for (what, view) in named {
            check_size(what, view.texture(), size)?;
        }
        let resources = named.map(|(_, view)| wgpu::BindingResource::TextureView(view));
        let group = scoped(&context.device, "textures of a frame", || {
            Ok(bind::group(&context.device, "view of a reference", &self.view_layout, resources))
        })?;
        Ok(BoundTextures { size, group })
    }

    /// # Errors
    /// When the image is larger than the device's largest binding.
    pub(super) fn points(&self, scene: &SceneBuffers, ring: &Ring, size: Size) -> aonet::Result<Points> {
        let context = &scene.context;
        let buffer = || context.storage("start points", size.pixels() * POINT_BYTES);
        let buffers = [buffer()?, buffer()?, buffer()?];
        let [origins, normals, geo_normals] = &buffers;
        let seen = [&scene.nodes, &scene.triangles, origins, normals, geo_normals];
        let group = program::group(&context.device, "start points", &self.layout, &ring.buffer, &seen);
        Ok(Points { size, buffers, group })
    }

    /// Encodes the points of a frame.
    ///
    /// # Errors
    /// When view or camera are of another size, or the frame's numbers are out of range.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundTextures,
        frame: &FrameNumbers,
        Destination { context, ring, points }: Destination<'_>,
    ) -> aonet::Result<()> {
        points.size.expect("view", view.size)?;
        points.size.expect("camera of a frame", frame.camera.size())?;
        let numbers = ring.put(&context.queue, &frame_words(self.depth, frame)?);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("start points"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &points.group, &[numbers]);
        pass.set_bind_group(1, &view.group, &[]);
        let [x, y] = [points.size.width().div_ceil(TILE[0]), points.size.height().div_ceil(TILE[1])];
        pass.dispatch_workgroups(x as u32, y as u32, 1);
        Ok(())
    }
}

impl Points {
    /// Uploads the points of `surface`, equal to a CPU's.
    ///
    /// # Errors
    /// When it is of another size, or not of `scene`.
    pub(super) fn upload(&self, context: &Context, scene: &Scene, surface: &Surface) -> Result<()> {
        self.size.expect("surface", surface.gbuffer.size())?;
        surface.check_of(scene)?;
        let mut bytes = [(); 3].map(|()| vec![0; self.size.pixels() * POINT_BYTES]);
        let [origins, normals, geo_normals] = bytes.each_mut().map(|b| b.par_chunks_exact_mut(POINT_BYTES));
        origins.zip(normals).zip(geo_normals).enumerate().for_each(|(i, ((origin, normal), geo_normal))| {
            if let Some(point) = Point::new(scene, surface, i) {
                put(origin, point.origin);
                put(normal, point.normal);
                put(geo_normal, point.geo_normal);
            }
        });
        Ok(scoped(&context.device, "start points", || {
            self.buffers.iter().zip(&bytes).for_each(|(to, of)| context.queue.write_buffer(to, 0, of));
            Ok(())
        })?)
    }
}

/// A vector, little-endian.
fn put(bytes: &mut [u8], vector: Vec3A) {
    let components = bytes.chunks_exact_mut(size_of::<f32>()).zip(vector.to_array());
    components.for_each(|(bytes, x)| bytes.copy_from_slice(&x.to_le_bytes()));
}

/// The struct `Frame` of `start.wgsl`.
///
/// # Errors
/// When the camera or a plane is out of range.
fn frame_words(encoding: DepthEncoding, frame: &FrameNumbers) -> aonet::Result<[u32; 16 + LENS_WORDS]> {
    let mut words = [0; 16 + LENS_WORDS];
    let world_from_view = frame.camera.view_from_world().inverse();
    for (column, to) in world_from_view.to_cols_array_2d().iter().zip(words.chunks_exact_mut(4)) {
        to.iter_mut().zip(column).for_each(|(word, v)| *word = v.to_bits());
    }
    words[16..].copy_from_slice(&Lens::new(encoding, frame)?.words());
    Ok(words)
}
