//! Traces the reference, a few rays at a time.

use super::image::Image;
use super::memory::{Context, PLACES, Ring};
use super::order::{Batch, Walk};
use super::program;
use super::scene::{self, SceneBuffers};
use super::start::{BoundTextures, Destination, Points, Start, SurfaceViews};
use crate::gbuffer::Surface;
use crate::reference::{Sampling, spiral};
use crate::trace::Tracer;
use crate::{Error, Result};
use aonet::gpu::{DepthEncoding, FrameNumbers, wgpu};
use aonet::internals::gpu::{bind, scoped};
use aonet::{AoParams, Size};

/// Most rays of a dispatch, so that it ends before a driver's watchdog acts.
// guess: a tenth of a second at ten million rays per second, which is slow.
pub(super) const DISPATCH_RAYS: u32 = 1 << 20;

/// Most rays of one [`Reference::encode`].
pub const RAYS_AT_ONCE: u64 = (PLACES as u64 / 4) * DISPATCH_RAYS as u64;

/// Invocations of a workgroup.
const GROUP: u32 = 64;

/// Options of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceOptions {
    /// The sequence of rays, as on a CPU. When it ends it starts again, turned.
    pub sampling: Sampling,
    /// Encoding of depth textures.
    pub depth: DepthEncoding,
    /// Format of the AO texture: one that can be rendered to and holds a float in its first channel, such as `R8Unorm`
    /// or `R16Float`.
    pub output: wgpu::TextureFormat,
}

impl Default for ReferenceOptions {
    /// 256 rays in a sequence, reversed depth, 16 bits of visibility.
    fn default() -> Self {
        Self {
            sampling: Sampling { spp: 256, seed: 0 },
            depth: DepthEncoding::default(),
            output: wgpu::TextureFormat::R16Float,
        }
    }
}

/// The reference AO of a scene at one size; every ray makes it more exact.
#[derive(Debug)]
pub struct Reference {
    scene: SceneBuffers,
    options: ReferenceOptions,
    programs: Programs,
    spokes: wgpu::Buffer,
    ring: Ring,
    sized: Sized,
    radius: f32,
    walk: Walk,
}

/// Compiled shaders.
#[derive(Debug)]
struct Programs {
    start: Start,
    rays: wgpu::ComputePipeline,
    rays_layout: wgpu::BindGroupLayout,
    image: Image,
}

/// What the rays of every size read: the parameters of dispatches, and the points of the spiral.
#[derive(Debug, Clone, Copy)]
struct Parameters<'a> {
    ring: &'a Ring,
    spokes: &'a wgpu::Buffer,
}

/// Resources that depend on the size.
#[derive(Debug)]
struct Sized {
    size: Size,
    points: Points,
    open: wgpu::Buffer,
    rays: wgpu::BindGroup,
    image: wgpu::BindGroup,
}

/// Rays of a range of pixels, few enough for one dispatch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dispatch {
    batch: Batch,
    pub(super) first_pixel: u32,
    pub(super) pixels: u32,
}

impl Dispatch {
    /// Rays a pixel.
    pub(super) fn rays(&self) -> u32 {
        self.batch.rays
    }
}

/// The shader of the rays.
pub(super) fn source() -> String {
    scene::traverse() + include_str!("reference.wgsl")
}

impl Reference {
    /// A reference of `size`: all background until [`start`](Self::start) or [`set_surface`](Self::set_surface).
    ///
    /// # Errors
    /// When the image is too large for the device, `spp` is 0 or too large, the output cannot be rendered to,
    /// or there is not enough memory.
    pub fn new(scene: &SceneBuffers, size: Size, options: ReferenceOptions) -> Result<Self> {
        options.sampling.check()?;
        let context = &scene.context;
        let made = scoped(&context.device, "reference", || {
            let programs = Programs::new(context, &options);
            let ring = context.ring();
            let spokes = spokes(context, options.sampling)?;
            let sized = Sized::new(scene, &programs, Parameters { ring: &ring, spokes: &spokes }, size)?;
            Ok((programs, ring, spokes, sized))
        });
        let (programs, ring, spokes, sized) = made?;
        let walk = Walk::new(options.sampling.spp);
        Ok(Self { scene: scene.clone(), options, programs, spokes, ring, sized, radius: 1.0, walk })
    }

    /// Changes the size to `size`; views of another size become invalid, and the start of rays
    /// must be set again. After an error the reference does not change.
    ///
    /// # Errors
    /// When the image is too large for the device, or there is not enough memory.
    pub fn resize(&mut self, size: Size) -> Result<()> {
        let parameters = Parameters { ring: &self.ring, spokes: &self.spokes };
        self.sized = scoped(&self.scene.context.device, "reference", || {
            Sized::new(&self.scene, &self.programs, parameters, size)
        })?;
        self.reset();
        Ok(())
    }

    /// Discards all rays and continues with another sequence.
    ///
    /// # Errors
    /// When `spp` is 0 or too large, or there is not enough memory; the reference then does not change.
    pub fn set_sampling(&mut self, sampling: Sampling) -> Result<()> {
        sampling.check()?;
        if sampling.spp != self.options.sampling.spp {
            let context = &self.scene.context;
            (self.spokes, self.sized.rays) = scoped(&context.device, "reference", || {
                let spokes = spokes(context, sampling)?;
                let parameters = Parameters { ring: &self.ring, spokes: &spokes };
                let Sized { points, open, .. } = &self.sized;
                let rays = self.programs.rays_group(&self.scene, parameters, points, open);
                Ok((spokes, rays))
            })?;
        }
        self.options.sampling = sampling;
        self.reset();
        Ok(())
    }

    /// Discards all rays; the start points stay.
    pub fn reset(&mut self) {
        self.walk = Walk::new(self.options.sampling.spp);
    }

    /// Number of rays of each pixel that were encoded so far.
    pub fn samples(&self) -> u32 {
        self.walk.samples
    }

    /// The size of the image.
    pub fn size(&self) -> Size {
        self.sized.size
    }

    /// The options.
    pub fn options(&self) -> ReferenceOptions {
        self.options
    }

    /// Starts again from `surface`, with the rays of [`reference_ao`](crate::reference::reference_ao). The points are
    /// written with the next submission.
    ///
    /// # Errors
    /// When it is of another size, or has triangles that the scene of `tracer` lacks. `tracer` must have the scene of the
    /// buffers.
    pub fn set_surface(&mut self, tracer: &Tracer, surface: &Surface, params: AoParams) -> Result<()> {
        self.radius = params.radius();
        self.sized.points.upload(&self.scene.context, tracer.scene(), surface)?;
        self.reset();
        Ok(())
    }

    /// A view of a frame's textures.
    ///
    /// # Errors
    /// When a texture has another size, or a format or usage that cannot be read.
    pub fn view(&self, textures: SurfaceViews<'_>) -> Result<BoundTextures> {
        Ok(self.programs.start.view(&self.scene.context, self.sized.size, textures)?)
    }

    /// Starts again from the surface that the textures of `view` show when the commands run. Rays start just above the triangle
    /// there, up to a sixteenth of a pixel away, because rasterisers snap vertices to a grid. Without such a triangle they start
    /// just above the position of the textures.
    ///
    /// # Errors
    /// When view or camera have another size than the reference, or the frame's numbers are out of range.
    pub fn start(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundTextures,
        frame: &FrameNumbers,
    ) -> Result<()> {
        let radius = frame.params.radius();
        let to =
            Destination { context: &self.scene.context, ring: &mut self.ring, points: &self.sized.points };
        self.programs.start.encode(encoder, view, frame, to)?;
        self.radius = radius;
        self.reset();
        Ok(())
    }

    /// Encodes `samples` more rays per pixel, then writes the share of open rays to `visibility`: 1 on the
    /// background and without rays. It does not wait, reads nothing back, and allocates no memory on the
    /// device.
    ///
    /// No dispatch has more than a million rays, but a whole submission can take longer than a driver's watchdog allows: the
    /// caller chooses its size. A submission can have a thousand dispatches, each with at most the next lower power of two of
    /// the samples.
    ///
    /// # Errors
    /// When `visibility` has another size or format than the reference or cannot be rendered to, or all pixels together
    /// have more than [`RAYS_AT_ONCE`] rays, or one has more than 2^32.
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        samples: u32,
        visibility: &wgpu::TextureView,
    ) -> Result<()> {
        self.programs.image.check(visibility, self.sized.size)?;
        self.check(samples)?;
        if self.walk.samples == 0 {
            encoder.clear_buffer(&self.sized.open, 0, None);
        }
        self.each_dispatch(samples, |this, dispatch| {
            this.encode_rays(encoder, dispatch);
            Ok(())
        })?;
        let words = [self.sized.size.width() as u32, self.walk.samples];
        let numbers = self.ring.put(&self.scene.context.queue, &words);
        self.programs.image.encode(encoder, visibility, (&self.sized.image, numbers));
        Ok(())
    }

    /// # Errors
    /// When there would be too many rays.
    fn check(&self, samples: u32) -> Result<()> {
        let rays = u64::from(samples) * self.pixels() as u64;
        if rays > RAYS_AT_ONCE {
            return Err(Error::request("rays at once", format!("at most {RAYS_AT_ONCE}"), rays));
        }
        if self.walk.samples.checked_add(samples).is_none() {
            let found = u64::from(self.walk.samples) + u64::from(samples);
            return Err(Error::request("rays of a pixel", "fewer than 2^32", found));
        }
        Ok(())
    }

    fn pixels(&self) -> usize {
        self.sized.size.pixels()
    }

    /// Runs `samples` more rays a pixel in parts that are small enough.
    ///
    /// # Errors
    /// As `run`.
    pub(super) fn each_dispatch(
        &mut self,
        samples: u32,
        mut run: impl FnMut(&mut Self, Dispatch) -> aonet::Result<()>,
    ) -> aonet::Result<()> {
        let batches = self.walk.advance(samples);
        let all = self.pixels() as u32;
        for batch in batches {
            // Above zero: no spiral has more points than a dispatch has rays.
            let most = DISPATCH_RAYS / batch.rays;
            for first_pixel in (0..all).step_by(most as usize) {
                run(self, Dispatch { batch, first_pixel, pixels: most.min(all - first_pixel) })?;
            }
        }
        Ok(())
    }

    pub(super) fn encode_rays(&mut self, encoder: &mut wgpu::CommandEncoder, dispatch: Dispatch) {
        let Dispatch { batch, first_pixel, pixels } = dispatch;
        let Sampling { spp, seed } = self.options.sampling;
        let seed = seed.wrapping_add(batch.round);
        let words = [
            seed as u32,
            (seed >> 32) as u32,
            first_pixel,
            pixels,
            batch.first,
            batch.stride,
            batch.rays,
            self.radius.to_bits(),
            (spp as f32).to_bits(),
        ];
        let numbers = self.ring.put(&self.scene.context.queue, &words);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reference rays"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.programs.rays);
        pass.set_bind_group(0, &self.sized.rays, &[numbers]);
        pass.dispatch_workgroups((pixels * batch.rays).div_ceil(GROUP), 1, 1);
    }

    /// Open rays of each pixel.
    pub(super) fn open(&self) -> &wgpu::Buffer {
        &self.sized.open
    }
}

/// The points of the spiral for shaders.
fn spokes(context: &Context, sampling: Sampling) -> aonet::Result<wgpu::Buffer> {
    let vectors = spiral(sampling.spp, 1).into_iter().flat_map(|s| [s.index, s.cos, s.sin, 0.0]);
    context.filled("spiral", &vectors.flat_map(f32::to_le_bytes).collect::<Vec<_>>())
}

impl Programs {
    fn new(context: &Context, options: &ReferenceOptions) -> Self {
        let device = &context.device;
        let mut types = [bind::READ; 8];
        (types[0], types[7]) = (bind::UNIFORM_AT_OFFSET, bind::WRITE);
        let rays_layout = bind::layout(device, "reference rays", wgpu::ShaderStages::COMPUTE, &types);
        let rays = program::compute(device, ("reference rays", &source()), &[&rays_layout]);
        let start = Start::new(context, options.depth);
        Self { start, rays, rays_layout, image: Image::new(context, options.output) }
    }

    /// The buffers of the rays, with these start points and this counter.
    fn rays_group(
        &self,
        scene: &SceneBuffers,
        parameters: Parameters<'_>,
        points: &Points,
        open: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let Parameters { ring, spokes } = parameters;
        let [origins, normals, geo_normals] = &points.buffers;
        let buffers = [&scene.nodes, &scene.triangles, spokes, origins, normals, geo_normals, open];
        program::group(&scene.context.device, "reference rays", &self.rays_layout, &ring.buffer, &buffers)
    }
}

impl Sized {
    fn new(
        scene: &SceneBuffers,
        programs: &Programs,
        parameters: Parameters<'_>,
        size: Size,
    ) -> aonet::Result<Self> {
        let context = &scene.context;
        let open = context.storage("open rays", size.pixels() * size_of::<u32>())?;
        let points = programs.start.points(scene, parameters.ring, size)?;
        let rays = programs.rays_group(scene, parameters, &points, &open);
        let image = programs.image.group(context, parameters.ring, &open);
        Ok(Self { size, points, open, rays, image })
    }
}
