//! The visibility of a frame by the methods that are seen.

use super::device::Gpu;
use super::frame::Frame;
use super::method::Method;
use super::stopwatch::Stopwatch;
use super::targets::{self, Target, Targets};
use crate::Result;
use aonet::net::gpu::{self, DepthEncoding, Options, Session, Textures, View, wgpu};
use aonet::net::{Model, shipped};

/// Methods in use and what they found.
#[derive(Debug)]
pub(super) struct Occlusion {
    gpu: Gpu,
    /// One texel: visibility 1 everywhere.
    open: Target,
    running: Vec<Running>,
    /// Methods of the last frame: only these move to a new size.
    seen: Vec<Method>,
}

/// A method at work.
#[derive(Debug)]
struct Running {
    method: Method,
    session: Session,
    view: View,
    visibility: Target,
}

impl Occlusion {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let open = Target::new(gpu, (1, 1), targets::VISIBILITY);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
        let one = half::f16::ONE.to_le_bytes();
        gpu.queue.write_texture(open.texture.as_image_copy(), &one, layout, open.texture.size());
        Self { gpu: gpu.clone(), open, running: Vec::new(), seen: Vec::new() }
    }

    /// Makes ready what a frame shows.
    ///
    /// # Errors
    /// When a method cannot run on the device, or memory is short.
    pub(super) fn prepare(&mut self, targets: &Targets, frame: &Frame) -> Result<()> {
        self.seen = frame.seen();
        for method in &self.seen {
            if self.running.iter().all(|running| running.method != *method) {
                self.running.extend(Running::new(&self.gpu, *method, targets)?);
            }
        }
        Ok(())
    }

    /// Encodes the methods of a frame that [`Occlusion::prepare`] has seen.
    ///
    /// # Errors
    /// When the frame's numbers are out of range.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame,
        mut watch: Option<&mut Stopwatch>,
    ) -> Result<()> {
        for running in self.running.iter().filter(|running| self.seen.contains(&running.method)) {
            running.encode(encoder, frame, watch.as_deref_mut())?;
        }
        Ok(())
    }

    /// What a method found in the last frame.
    pub(super) fn visibility(&self, method: Method) -> &Target {
        let running = self.running.iter().find(|running| running.method == method);
        running.map_or(&self.open, |running| &running.visibility)
    }

    /// Moves to textures of another size.
    ///
    /// # Errors
    /// When memory is short; the methods start anew in the next frame then.
    pub(super) fn resize(&mut self, targets: &Targets) -> Result<()> {
        let seen = std::mem::take(&mut self.seen);
        let kept = std::mem::take(&mut self.running).into_iter().filter(|r| seen.contains(&r.method));
        self.running = kept.map(|running| running.resized(&self.gpu, targets)).collect::<Result<_>>()?;
        Ok(())
    }

    /// Forgets what was gathered over frames.
    pub(super) fn restart(&mut self) {}
}

impl Running {
    fn new(gpu: &Gpu, method: Method, targets: &Targets) -> Result<Option<Self>> {
        let options =
            Options { depth: DepthEncoding::Linear, output: targets::VISIBILITY, ..Options::default() };
        let network = |bytes| {
            Session::new((&gpu.device, &gpu.queue), &Model::from_bytes(bytes)?, targets.size, options)
        };
        let session = match method {
            Method::Off | Method::Reference => return Ok(None),
            Method::Network => network(shipped::ANY_RADIUS)?,
            Method::Paper => network(shipped::PAPER)?,
        };
        let visibility = Target::new(gpu, targets.size, targets::VISIBILITY);
        let view = session.view(textures(targets, &visibility))?;
        Ok(Some(Self { method, session, view, visibility }))
    }

    fn resized(mut self, gpu: &Gpu, targets: &Targets) -> Result<Self> {
        self.session.resize(targets.size)?;
        self.visibility = Target::new(gpu, targets.size, targets::VISIBILITY);
        self.view = self.session.view(textures(targets, &self.visibility))?;
        Ok(self)
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame,
        watch: Option<&mut Stopwatch>,
    ) -> Result<()> {
        let of = gpu::Frame { camera: frame.camera, far: frame.far, params: frame.params };
        let passes = self.session.pass_labels().len();
        match watch.and_then(|watch| watch.session(self.method.title(), passes)) {
            Some(times) => self.session.encode_timed(encoder, &self.view, &of, times)?,
            None => self.session.encode(encoder, &self.view, &of)?,
        }
        Ok(())
    }
}

fn textures<'a>(targets: &'a Targets, visibility: &'a Target) -> Textures<'a> {
    Textures { normal: &targets.normal.view, depth: &targets.depth.view, visibility: &visibility.view }
}
