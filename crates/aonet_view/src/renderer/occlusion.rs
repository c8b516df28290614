//! Visibility of a frame by the methods that it shows.

use super::converging::Converging;
use super::device::Gpu;
use super::frame::{CheckedFrame, Show};
use super::method::Method;
use super::stopwatch::Stopwatch;
use super::targets::{self, Target, Targets};
use crate::{Error, Result};
use aonet::Size;
use aonet::gpu::{self, BoundFrame, DepthEncoding, FrameViews, Kernels, Layers, Options, wgpu};
use aonet::net::gpu::Session;
use aonet::net::{Model, shipped};
use aonet::search::gpu::ClassicSession;
use aonet::search::{ArcsParams, Classic};
use aonet_scene::trace::Tracer;

/// Methods in use, and their visibility.
#[derive(Debug)]
pub(super) struct Occlusion {
    gpu: Gpu,
    /// Kernels of the networks.
    pub(super) kernels: Kernels,
    /// One texel: visibility 1 everywhere.
    open: Target,
    /// One texel: no bent normals.
    unbent: Target,
    running: Vec<Running>,
    /// The picture of the shares of light, in frames that show it.
    shares: Option<Running>,
    /// None until there is a tracer.
    reference: Option<Converging>,
    /// Methods of the last frame; only these are kept when the size changes.
    seen: Vec<Method>,
}

/// A method with its resources. It runs on the picture and its guard band, and draws the picture.
#[derive(Debug)]
struct Running {
    method: Method,
    layers: Layers,
    session: Runner,
    view: BoundFrame,
    visibility: Target,
    /// Bent normals, where they are wanted.
    bent: Option<Target>,
}

/// Two kinds of sessions with the same verbs.
#[derive(Debug)]
enum Runner {
    Network(Session),
    Classic(ClassicSession),
}

impl Occlusion {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let open = Target::new(gpu, Size::px(1, 1), targets::VISIBILITY);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
        let one = half::f16::ONE.to_le_bytes();
        gpu.queue.write_texture(open.texture.as_image_copy(), &one, layout, open.texture.size());
        let (kernels, unbent) = (Kernels::Plain, Target::new(gpu, Size::px(1, 1), targets::BENT));
        Self {
            gpu: gpu.clone(),
            kernels,
            open,
            unbent,
            running: Vec::new(),
            shares: None,
            reference: None,
            seen: Vec::new(),
        }
    }

    /// Prepares the methods that a frame shows.
    ///
    /// # Errors
    /// When a method cannot run on the device, or memory is short.
    pub(super) fn prepare(&mut self, targets: &Targets, frame: &CheckedFrame) -> Result<()> {
        self.seen = frame.params.seen();
        let of_frame = if frame.separation_units.is_some() { Layers::Two } else { Layers::One };
        self.shares = match (frame.params.show, self.shares.take()) {
            (Show::Shares, Some(shares)) if shares.layers == of_frame => Some(shares),
            (Show::Shares, _) => Some(Running::shares(&self.gpu, of_frame, targets)?),
            _ => None,
        };
        for method in &self.seen {
            if *method == Method::Reference {
                let reference = self.reference.as_mut().ok_or_else(|| {
                    Error::request("reference", "a tracer of the scene (Renderer::set_tracer)", "none")
                })?;
                reference.prepare(&self.gpu, targets)?;
                continue;
            }
            let bends = frame.params.shows_bent_normals() && method.has_bent_normals();
            let wanted = (*method, method.layers(of_frame), bends);
            if self.running.iter().all(|running| running.kind() != wanted) {
                self.running.retain(|running| running.method != *method);
                self.running.extend(Running::new((&self.gpu, self.kernels), wanted, targets)?);
            }
        }
        Ok(())
    }

    /// Encodes the methods of a frame that [`Occlusion::prepare`] prepared.
    ///
    /// # Errors
    /// When the frame's numbers are out of range.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &CheckedFrame,
        mut watch: Option<&mut Stopwatch>,
    ) -> Result<()> {
        let methods = self.running.iter().filter(|running| self.seen.contains(&running.method));
        for running in methods.chain(&self.shares) {
            running.encode(encoder, frame, watch.as_deref_mut())?;
        }
        match &mut self.reference {
            Some(reference) if self.seen.contains(&Method::Reference) => {
                reference.encode(encoder, &frame.params, watch)
            }
            _ => Ok(()),
        }
    }

    /// A method's visibility of the last frame.
    pub(super) fn visibility(&self, method: Method) -> &Target {
        if method == Method::Reference {
            return self.reference.as_ref().and_then(Converging::visibility).unwrap_or(&self.open);
        }
        let running = self.running.iter().find(|running| running.method == method);
        running.map_or(&self.open, |running| &running.visibility)
    }

    /// A method's bent normals of the last frame; one texel of zeros where there are none.
    pub(super) fn bent_normals(&self, method: Method) -> &Target {
        let running = self.running.iter().find(|running| running.method == method);
        running.and_then(|running| running.bent.as_ref()).unwrap_or(&self.unbent)
    }

    /// The shares of light of the last frame as colours.
    pub(super) fn shares(&self) -> &Target {
        self.shares.as_ref().map_or(&self.open, |shares| &shares.visibility)
    }

    /// Moves to textures of another size.
    ///
    /// # Errors
    /// When memory is short; the next frame then creates the methods again.
    pub(super) fn resize(&mut self, targets: &Targets) -> Result<()> {
        let seen = std::mem::take(&mut self.seen);
        self.shares = None;
        // The textures of a second layer come with the next frame that has one.
        let kept = |r: &Running| seen.contains(&r.method) && r.layers == Layers::One;
        let kept = std::mem::take(&mut self.running).into_iter().filter(kept);
        self.running = kept.map(|running| running.resized(&self.gpu, targets)).collect::<Result<_>>()?;
        Ok(())
    }

    /// Lets the methods read other textures of the same size.
    ///
    /// # Errors
    /// When memory is short.
    pub(super) fn rebind(&mut self, targets: &Targets) -> Result<()> {
        for running in self.running.iter_mut().chain(&mut self.shares) {
            running.view = running.session.bind(targets, (&running.visibility, running.bent.as_ref()))?;
        }
        Ok(())
    }

    /// Adds the reference.
    ///
    /// # Errors
    /// When the scene is too large for the device.
    pub(super) fn set_tracer(&mut self, tracer: &Tracer) -> Result<()> {
        self.reference = Some(Converging::new(&self.gpu, tracer)?);
        Ok(())
    }

    /// Removes the reference, because the scene changed.
    pub(super) fn forget_tracer(&mut self) {
        self.reference = None;
    }

    /// Rays per pixel of the reference so far.
    pub(super) fn samples(&self) -> u32 {
        self.reference.as_ref().map_or(0, Converging::samples)
    }
}

impl Running {
    fn new(
        (gpu, kernels): (&Gpu, Kernels),
        (method, layers, bends): (Method, Layers, bool),
        targets: &Targets,
    ) -> Result<Option<Self>> {
        let (depth, output) = (DepthEncoding::Linear, targets::VISIBILITY);
        let options = Options { depth, layers, output, ..Options::default() };
        let (pair, size) = ((&gpu.device, &gpu.queue), targets.window.buffer_size());
        let network = |bytes| {
            let model = Model::from_bytes(bytes)?;
            let options = Options { kernels, ..options };
            let session = match bends {
                true => Session::with_bent_normals(pair, &model, size, options, targets::BENT),
                false => Session::new(pair, &model, size, options),
            };
            session.map(Runner::Network)
        };
        let session = match method {
            Method::Off | Method::Reference => return Ok(None),
            Method::Fast => network(shipped::FAST)?,
            Method::Balanced => network(shipped::BALANCED)?,
            Method::High => network(shipped::HIGH)?,
            Method::Paper => network(shipped::PAPER)?,
            Method::Ssao
            | Method::SsaoTuned
            | Method::Hbao
            | Method::HbaoTuned
            | Method::Gtao
            | Method::GtaoTuned
            | Method::Vbao
            | Method::VbaoTuned
            | Method::Agtao
            | Method::AgtaoTuned
            | Method::Arcs
            | Method::ArcsTuned => {
                let classic = Classic::named(method.name())?;
                Runner::Classic(match bends {
                    true => ClassicSession::with_bent_normals(pair, &classic, size, options, targets::BENT)?,
                    false => ClassicSession::new(pair, &classic, size, options)?,
                })
            }
        };
        let visibility = Target::new(gpu, targets.window.size(), targets::VISIBILITY);
        let bent = bends.then(|| Target::new(gpu, targets.window.size(), targets::BENT));
        let view = session.bind(targets, (&visibility, bent.as_ref()))?;
        Ok(Some(Self { method, layers, session, view, visibility, bent }))
    }

    fn shares(gpu: &Gpu, layers: Layers, targets: &Targets) -> Result<Self> {
        let (depth, output) = (DepthEncoding::Linear, targets::PICTURE);
        let options = Options { depth, layers, output, ..Options::default() };
        let (pair, size) = ((&gpu.device, &gpu.queue), targets.window.buffer_size());
        let session = ClassicSession::shares(pair, &ArcsParams::default(), size, options)?;
        let session = Runner::Classic(session);
        let visibility = Target::new(gpu, targets.window.size(), output);
        let view = session.bind(targets, (&visibility, None))?;
        Ok(Self { method: Method::Arcs, layers, session, view, visibility, bent: None })
    }

    /// What it was made for.
    fn kind(&self) -> (Method, Layers, bool) {
        (self.method, self.layers, self.bent.is_some())
    }

    fn resized(mut self, gpu: &Gpu, targets: &Targets) -> Result<Self> {
        let size = targets.window.buffer_size();
        match &mut self.session {
            Runner::Network(session) => session.resize(size)?,
            Runner::Classic(session) => session.resize(size)?,
        }
        self.visibility = Target::new(gpu, targets.window.size(), targets::VISIBILITY);
        self.bent = self.bent.map(|_| Target::new(gpu, targets.window.size(), targets::BENT));
        self.view = self.session.bind(targets, (&self.visibility, self.bent.as_ref()))?;
        Ok(self)
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &CheckedFrame,
        watch: Option<&mut Stopwatch>,
    ) -> Result<()> {
        let CheckedFrame { params: frame, buffer_camera, .. } = *frame;
        let of = gpu::FrameNumbers { camera: buffer_camera, far: frame.far, params: frame.params };
        let passes = match &self.session {
            Runner::Network(session) => session.pass_labels().len(),
            Runner::Classic(session) => session.pass_labels().len(),
        };
        let view = &self.view;
        let times = watch.and_then(|watch| watch.session(self.method.title(), passes));
        match (&self.session, times) {
            (Runner::Network(session), Some(times)) => session.encode_timed(encoder, view, &of, times)?,
            (Runner::Network(session), None) => session.encode(encoder, view, &of)?,
            (Runner::Classic(session), Some(times)) => session.encode_timed(encoder, view, &of, times)?,
            (Runner::Classic(session), None) => session.encode(encoder, view, &of)?,
        }
        Ok(())
    }
}

impl Runner {
    /// Binds the textures of a frame, and those that the method writes: visibility, and bent normals where it has some.
    fn bind(&self, targets: &Targets, (visibility, bent): (&Target, Option<&Target>)) -> Result<BoundFrame> {
        let views = FrameViews {
            normal: &targets.normal.view,
            depth: &targets.depth.view,
            second: targets.second.as_ref().map(|second| &second.depth.view),
            visibility: &visibility.view,
        };
        Ok(match (self, bent) {
            (Self::Network(session), Some(bent)) => session.bind_with_bent_normals(views, &bent.view)?,
            (Self::Network(session), None) => session.bind(views)?,
            (Self::Classic(session), Some(bent)) => session.bind_with_bent_normals(views, &bent.view)?,
            (Self::Classic(session), None) => session.bind(views)?,
        })
    }
}
