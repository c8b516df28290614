//! A frame: rasterise the G-buffer, compute visibility by up to two methods, light, tone map, present.
//!
//! A renderer of a [`Window`] rasterises the picture and a guard band around it; methods read both and give the picture. With
//! [`FrameParams::separation`] a frame also has a second layer: the nearest surfaces that far behind the visible ones.
//!
//! ```no_run
//! use aonet::gpu::Device;
//! use aonet_scene::scene::procedural;
//! use aonet_view::renderer::{FrameParams, Renderer, readback};
//!
//! let device = Device::wait_for()?;
//! let (scene, view) = procedural::demo();
//! let mut renderer = Renderer::on(&device, &scene, view.size()?)?;
//! let frame = FrameParams::new(view.camera()?, view.params()?);
//! let mut encoder = device.device.create_command_encoder(&Default::default());
//! renderer.encode(&mut encoder, &frame)?;
//! device.queue.submit([encoder.finish()]);
//! let rgba = readback::picture(&renderer)?;
//! # Ok::<(), aonet_view::Error>(())
//! ```

mod converging;
mod decode;
mod device;
mod frame;
mod gbuffer;
mod method;
mod occlusion;
mod orbit;
mod pass_clock;
mod path;
mod present;
#[cfg(not(target_arch = "wasm32"))]
pub mod readback;
mod scene;
mod shade;
mod stopwatch;
mod targets;
#[cfg(test)]
mod tests;
mod textures;

pub use frame::{FrameParams, Show};
pub use method::Method;
pub use orbit::Orbit;
pub use pass_clock::PassClock;
pub use path::{CameraPath, Key};
pub use present::Present;
pub use stopwatch::PassTime;

use crate::Result;
use aonet::gpu::{Device, Kernels, wgpu};
use aonet::internals::gpu::scoped;
use aonet::{Size, Window};
use aonet_scene::Scene;
use aonet_scene::scene::Bounds;
use aonet_scene::trace::Tracer;
use device::Gpu;
use frame::CheckedFrame;
use gbuffer::GbufferPass;
use occlusion::Occlusion;
use scene::SceneBuffers;
use shade::ShadePass;
use stopwatch::Stopwatch;
use targets::{SecondTargets, Targets};

/// Everything on the device that drawing a scene needs, at one size.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    scene: SceneBuffers,
    targets: Targets,
    /// Whether the last frame has a second layer.
    has_second: bool,
    gbuffer: GbufferPass,
    occlusion: Occlusion,
    shade: ShadePass,
    stopwatch: Option<Stopwatch>,
}

impl Renderer {
    /// A renderer of `scene`, whose images (PNG, JPEG) are decoded, with frames of a size ([`Size`]), or with a guard band
    /// around them ([`Window`]). The device needs the default limits of WebGPU; its features `SHADER_F16` and
    /// `TIMESTAMP_QUERY` are used where it has them.
    ///
    /// # Errors
    /// When a side or the scene is too large for the device.
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        scene: &Scene,
        window: impl Into<Window>,
    ) -> Result<Self> {
        let gpu = Gpu { device: device.clone(), queue: queue.clone() };
        let window = window.into();
        targets::check_size(&gpu, window)?;
        let buffers = SceneBuffers::new(&gpu, scene)?;
        let renderer = scoped(device, "renderer", || {
            Ok(Self {
                scene: buffers,
                targets: Targets::new(&gpu, window),
                has_second: false,
                gbuffer: GbufferPass::new(&gpu),
                occlusion: Occlusion::new(&gpu),
                shade: ShadePass::new(&gpu),
                stopwatch: Stopwatch::new(&gpu),
                gpu: gpu.clone(),
            })
        })?;
        Ok(renderer)
    }

    /// Creates a renderer on a [`Device`], whose cooperative matrices the networks use.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn on(device: &Device, scene: &Scene, window: impl Into<Window>) -> Result<Self> {
        let mut renderer = Self::new((&device.device, &device.queue), scene, window)?;
        renderer.occlusion.kernels = device.matrices.map_or(Kernels::Plain, Kernels::Matrices);
        Ok(renderer)
    }

    /// Shows another scene, which has no reference until [`Renderer::set_tracer`] brings it.
    ///
    /// # Errors
    /// When it is too large for the device; the old scene then stays.
    pub fn set_scene(&mut self, scene: &Scene) -> Result<()> {
        self.scene = SceneBuffers::new(&self.gpu, scene)?;
        self.occlusion.forget_tracer();
        Ok(())
    }

    /// Uploads the hierarchy of the scene, which [`Method::Reference`] needs.
    ///
    /// # Errors
    /// When it is too large for the device.
    pub fn set_tracer(&mut self, tracer: &Tracer) -> Result<()> {
        self.occlusion.set_tracer(tracer)
    }

    /// Rays a pixel of the reference so far.
    pub fn samples(&self) -> u32 {
        self.occlusion.samples()
    }

    /// Changes the size of the frames and of the guard band around them.
    ///
    /// # Errors
    /// When a side is too large for the device, or there is not enough memory; the renderer then does not change.
    pub fn resize(&mut self, window: impl Into<Window>) -> Result<()> {
        let window = window.into();
        if window == self.window() {
            return Ok(());
        }
        targets::check_size(&self.gpu, window)?;
        let targets = scoped(&self.gpu.device, "targets", || Ok(Targets::new(&self.gpu, window)))?;
        self.occlusion.resize(&targets)?;
        self.targets = targets;
        self.has_second = false;
        Ok(())
    }

    /// Creates or keeps the textures that a frame needs beside those of every frame.
    fn prepare(&mut self, frame: &CheckedFrame) -> Result<()> {
        self.has_second = frame.separation_units.is_some();
        if self.has_second && self.targets.second.is_none() {
            let window = self.targets.window;
            let made = scoped(&self.gpu.device, "second layer", || Ok(SecondTargets::new(&self.gpu, window)));
            self.targets.second = Some(made?);
            self.occlusion.rebind(&self.targets)?;
        }
        self.occlusion.prepare(&self.targets, frame)
    }

    /// Encodes a frame's passes, up to [`Renderer::picture`], without waiting. A method's first frame compiles its shaders
    /// and allocates its memory.
    ///
    /// The frame's numbers are written with the next submission, so a submission can hold one frame.
    ///
    /// # Errors
    /// When the camera is of another size or out of range, a method cannot run on the device, the reference has no tracer, or
    /// memory is short.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, frame: &FrameParams) -> Result<()> {
        self.begin(encoder, frame)?;
        self.finish(encoder);
        Ok(())
    }

    /// Encodes a frame's passes for callers that add passes of their own: [`Renderer::clock`] times them, and
    /// [`Renderer::finish`] ends the frame.
    ///
    /// # Errors
    /// As [`Renderer::encode`]; the encoder must then be dropped.
    pub fn begin(&mut self, encoder: &mut wgpu::CommandEncoder, frame: &FrameParams) -> Result<()> {
        self.stopwatch.iter_mut().for_each(Stopwatch::stop);
        let frame = frame.checked(self.window())?;
        self.prepare(&frame)?;
        let mut watch = self.stopwatch.as_mut().and_then(Stopwatch::start);
        self.gbuffer.encode(encoder, (&self.scene, &self.targets), &frame, watch.as_deref_mut());
        let found = self.occlusion.encode(encoder, &frame, watch.as_deref_mut());
        if found.is_err() {
            watch.into_iter().for_each(Stopwatch::stop);
            return found;
        }
        self.shade.encode(encoder, (&self.targets, &self.occlusion), &frame.params, watch);
        Ok(())
    }

    /// Where a pass of the caller between [`Renderer::begin`] and [`Renderer::finish`] writes its times;
    /// [`Renderer::times`] reports them under this label. None if the frame is not timed. A frame can have three.
    pub fn clock(&mut self, label: &str) -> Option<PassClock> {
        self.stopwatch.as_mut().and_then(|watch| watch.pass(label))
    }

    /// Ends the frame that [`Renderer::begin`] began, in the same encoder.
    pub fn finish(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.stopwatch.iter_mut().for_each(|watch| watch.finish(encoder));
    }

    /// The finished frame: `Rgba8Unorm` with sRGB values.
    pub fn picture(&self) -> &wgpu::Texture {
        &self.targets.picture.texture
    }

    /// Whether the device times passes.
    pub fn has_clock(&self) -> bool {
        self.stopwatch.is_some()
    }

    /// Times of the steps of the last frame whose times have come back; none where the device has no `TIMESTAMP_QUERY`.
    pub fn times(&self) -> &[PassTime] {
        self.stopwatch.as_ref().map_or(&[], Stopwatch::latest)
    }

    /// Messages about images of the scene that are not shown, each with the image's name. A plain colour replaces them.
    pub fn missing_images(&self) -> &[String] {
        &self.scene.textures.missing
    }

    /// [`Renderer::missing_images`] as one sentence for a panel: the first message, shortened if the image's name is long, and the
    /// number of others. None when all images are shown.
    pub fn missing(&self) -> Option<String> {
        textures::sentence(self.missing_images())
    }

    /// Box around the scene.
    pub fn bounds(&self) -> Bounds {
        self.scene.bounds
    }

    /// The size of the frames, without their guard band.
    pub fn size(&self) -> Size {
        self.targets.window.size()
    }

    /// The size of the frames and of their guard band.
    pub fn window(&self) -> Window {
        self.targets.window
    }
}
