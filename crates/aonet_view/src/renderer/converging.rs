//! The ray-traced reference: it converges over frames in which nothing moves.

use super::device::Gpu;
use super::frame::FrameParams;
use super::method::Method;
use super::stopwatch::Stopwatch;
use super::targets::{self, Target, Targets};
use crate::Result;
use aonet::Window;
use aonet::gpu::{self as net, DepthEncoding, wgpu};
use aonet::internals::gpu::bind::extent;
use aonet_scene::gpu::{BoundTextures, Reference, ReferenceOptions, SceneBuffers, SurfaceViews};
use aonet_scene::trace::Tracer;

/// Rays per pixel after which the reference has converged: the remaining error is below one step of an 8-bit image.
// The standard deviation of a share of n rays is 1 / (2 sqrt n) at most.
const MOST_SAMPLES: u32 = 16_384;

/// Rays that have been traced from one camera.
#[derive(Debug)]
pub(super) struct Converging {
    scene: SceneBuffers,
    sized: Option<Sized>,
    /// The frame that the rays so far belong to.
    since: Option<net::FrameNumbers>,
}

/// Resources that depend on the size.
#[derive(Debug)]
struct Sized {
    reference: Reference,
    view: BoundTextures,
    visibility: Target,
    /// None without a guard band.
    picture: Option<Picture>,
    /// The depth of the targets that these resources belong to.
    depth: wgpu::TextureView,
}

/// The part of the G-buffer that rays start from: the picture without its guard band.
#[derive(Debug)]
struct Picture {
    /// Textures of the G-buffer, and those that their middle is copied into: normals, geometric normals, depth.
    copies: [(wgpu::Texture, Target); 3],
    window: Window,
}

impl Picture {
    /// None without a guard band: rays then start from the targets themselves.
    fn new(gpu: &Gpu, targets: &Targets) -> Option<Self> {
        let window = targets.window;
        if !window.has_margin() {
            return None;
        }
        let copy = |of: &Target| {
            let copy = Target::new(gpu, window.size(), of.texture.format());
            (of.texture.clone(), copy)
        };
        let copies = [&targets.normal, &targets.geo_normal, &targets.depth].map(copy);
        Some(Self { copies, window })
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let margin = self.window.margin();
        let origin = wgpu::Origin3d { x: margin.x as u32, y: margin.y as u32, z: 0 };
        for (from, to) in &self.copies {
            let middle = wgpu::TexelCopyTextureInfo { origin, ..from.as_image_copy() };
            encoder.copy_texture_to_texture(middle, to.texture.as_image_copy(), extent(self.window.size()));
        }
    }
}

impl Converging {
    /// # Errors
    /// When the scene is too large for the device.
    pub(super) fn new(gpu: &Gpu, tracer: &Tracer) -> Result<Self> {
        let scene = SceneBuffers::new((&gpu.device, &gpu.queue), tracer)?;
        Ok(Self { scene, sized: None, since: None })
    }

    /// Prepares for frames with these targets.
    ///
    /// # Errors
    /// When memory is short.
    pub(super) fn prepare(&mut self, gpu: &Gpu, targets: &Targets) -> Result<()> {
        if self.sized.as_ref().is_some_and(|sized| sized.depth == targets.depth.view) {
            return Ok(());
        }
        let options = ReferenceOptions {
            depth: DepthEncoding::Linear,
            output: targets::VISIBILITY,
            ..ReferenceOptions::default()
        };
        let size = targets.window.size();
        let reference = match self.sized.take() {
            Some(Sized { mut reference, .. }) => reference.resize(size).map(|()| reference),
            None => Reference::new(&self.scene, size, options),
        }?;
        let picture = Picture::new(gpu, targets);
        let [normal, geo_normal, depth] = match &picture {
            Some(picture) => picture.copies.each_ref().map(|(_, copy)| &copy.view),
            None => [&targets.normal, &targets.geo_normal, &targets.depth].map(|target| &target.view),
        };
        let view = reference.view(SurfaceViews { normal, geo_normal, depth })?;
        let visibility = Target::new(gpu, size, targets::VISIBILITY);
        let depth = targets.depth.view.clone();
        self.sized = Some(Sized { reference, view, visibility, picture, depth });
        self.since = None;
        Ok(())
    }

    /// Adds the rays of a frame; starts over if camera or radius changed.
    ///
    /// # Errors
    /// When the frame's numbers are out of range.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &FrameParams,
        watch: Option<&mut Stopwatch>,
    ) -> Result<()> {
        let Some(Sized { reference, view, visibility, picture, .. }) = &mut self.sized else { return Ok(()) };
        let of = net::FrameNumbers { camera: frame.camera, far: frame.far, params: frame.params };
        let starts = self.since != Some(of);
        let most = if starts { MOST_SAMPLES } else { MOST_SAMPLES.saturating_sub(reference.samples()) };
        let samples = frame.samples.min(most);
        // Without rays the image is white, and has to be written once.
        if !starts && samples == 0 && reference.samples() > 0 {
            return Ok(());
        }
        let clock = watch.and_then(|watch| watch.begin(encoder, Method::Reference.title()));
        if starts {
            picture.iter().for_each(|picture| picture.encode(encoder));
            reference.start(encoder, view, &of)?;
            self.since = Some(of);
        }
        reference.encode(encoder, samples, &visibility.view)?;
        clock.iter().for_each(|clock| clock.end(encoder));
        Ok(())
    }

    pub(super) fn visibility(&self) -> Option<&Target> {
        self.sized.as_ref().map(|sized| &sized.visibility)
    }

    pub(super) fn samples(&self) -> u32 {
        self.sized.as_ref().map_or(0, |sized| sized.reference.samples())
    }
}
