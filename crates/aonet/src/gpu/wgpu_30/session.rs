//! A program ready to run on a device.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::options::{FrameNumbers, Layers};
use crate::gpu::program::{Describe, Program};
use crate::gpu::wgpu_30::chain::{Chain, Timestamps};
use crate::gpu::wgpu_30::errors::{check_limits, scoped};
use crate::gpu::wgpu_30::host::Host;
use crate::gpu::wgpu_30::options::Outputs;
use crate::gpu::wgpu_30::view::{BoundFrame, FrameViews, Frames, check_size};
use std::sync::Arc;

/// A method and its memory on a device, for frames of one size. `M` describes the method's programs; it may be a [`Program`]
/// itself, which has one size.
#[derive(Debug)]
pub struct Session<M = Program> {
    pub(crate) method: Arc<M>,
    runner: Runner,
}

/// A program on a device.
#[derive(Debug)]
pub(crate) struct Runner {
    host: Arc<Host>,
    output: Outputs,
    program: Program,
    chain: Chain,
}

impl Session<Program> {
    /// A session that runs a program, with an AO texture of the format `output`.
    ///
    /// # Errors
    /// When the device lacks what the program needs or does not have enough memory, or a shader is not valid.
    pub fn new(
        on: (&wgpu::Device, &wgpu::Queue),
        program: Program,
        output: wgpu::TextureFormat,
    ) -> Result<Self> {
        let size = program.size();
        Self::of(on, program, size, output)
    }
}

impl<M: Describe> Session<M> {
    pub(crate) fn of(
        on: (&wgpu::Device, &wgpu::Queue),
        method: M,
        size: Size,
        output: impl Into<Outputs>,
    ) -> Result<Self> {
        check_limits(&on.0.limits())?;
        let program = method.program(size)?;
        let host = Arc::new(Host::new(on, program.textures.layers));
        let runner = Runner::new(host, program, output.into())?;
        Ok(Self { method: Arc::new(method), runner })
    }

    /// Another session with the same weights and shaders, for frames of another size.
    ///
    /// # Errors
    /// As [`Session::resize`].
    pub fn sibling(&self, size: Size) -> Result<Self> {
        let runner = self.runner.sibling(self.method.program(size)?)?;
        Ok(Self { method: Arc::clone(&self.method), runner })
    }

    /// Changes the size of the frames to `size`. Views of another size can no longer be used. After an error the session is
    /// unchanged.
    ///
    /// # Errors
    /// When a side is too large for the device, or there is not enough memory.
    pub fn resize(&mut self, size: Size) -> Result<()> {
        self.runner = self.runner.sibling(self.method.program(size)?)?;
        Ok(())
    }

    /// Binds a frame's textures; once for each camera that sees a frame.
    ///
    /// # Errors
    /// When a texture has another size, format or usage than the session needs, or the session writes bent normals as well.
    pub fn bind(&self, views: FrameViews<'_>) -> Result<BoundFrame> {
        self.runner.bind(views, None)
    }

    /// [`Session::bind`] for a session that was made with bent normals: they come to a second texture, of the same size as the
    /// visibility, in view space; its format tells how, as [`ClassicSession`](crate::search::gpu::ClassicSession) describes.
    ///
    /// # Errors
    /// As [`Session::bind`], and when the session has no bent normals.
    pub fn bind_with_bent_normals(
        &self,
        views: FrameViews<'_>,
        bent: &wgpu::TextureView,
    ) -> Result<BoundFrame> {
        self.runner.bind(views, Some(bent))
    }

    /// Encodes the passes of a frame: they read the normal and depth of `view` and write its visibility, in [0, 1],
    /// 1 on the background. Waits for nothing, reads nothing back and allocates no memory on the device.
    ///
    /// The frame's numbers are written when the encoder's commands are submitted next: a view that is encoded twice in
    /// one submission sees the second camera twice. Views of one session share its memory and run one after the other.
    ///
    /// # Errors
    /// When view or camera have another size than the session, or the frame's numbers are out of range.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundFrame,
        frame: &FrameNumbers,
    ) -> Result<()> {
        self.runner.encode(encoder, (view, frame), None)
    }

    /// [`Session::encode`] with every pass on its own and timed.
    ///
    /// # Errors
    /// As [`Session::encode`].
    pub fn encode_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &BoundFrame,
        frame: &FrameNumbers,
        timestamps: Timestamps<'_>,
    ) -> Result<()> {
        self.runner.encode(encoder, (view, frame), Some(timestamps))
    }

    /// Names of the passes of a frame in order.
    pub fn pass_labels(&self) -> Vec<&str> {
        self.program().pass_labels()
    }

    /// Size of its frames.
    pub fn size(&self) -> Size {
        self.program().size()
    }

    /// Bytes on the device that the passes hand over; weights not included.
    pub fn memory_bytes(&self) -> u64 {
        self.program().memory_bytes()
    }

    /// What runs.
    pub fn program(&self) -> &Program {
        &self.runner.program
    }

    /// The session without what describes its method.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn into_runner(self) -> Runner {
        self.runner
    }
}

impl Describe for Program {
    fn program(&self, size: Size) -> Result<Program> {
        if size == self.size {
            return Ok(self.clone());
        }
        Err(Error::size("session of a program", self.size, size))
    }
}

impl Runner {
    fn new(host: Arc<Host>, program: Program, output: Outputs) -> Result<Self> {
        check_size(&host.device, program.size)?;
        host.check_features(program.arithmetic)?;
        let chain = scoped(&host.device, "session", || Chain::new(&host, &program, output))?;
        Ok(Self { host, output, program, chain })
    }

    fn sibling(&self, program: Program) -> Result<Self> {
        Self::new(Arc::clone(&self.host), program, self.output)
    }

    /// Whether it writes bent normals.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn has_bent_normals(&self) -> bool {
        self.output.bent.is_some()
    }

    /// Layers of its frames.
    pub(crate) fn layers(&self) -> Layers {
        self.program.textures.layers
    }

    /// See [`Session::bind`].
    pub(crate) fn bind(&self, views: FrameViews<'_>, bent: Option<&wgpu::TextureView>) -> Result<BoundFrame> {
        let frames = Frames { size: self.program.size, layers: self.layers(), output: self.output };
        BoundFrame::new(&self.host.device, &self.host.frame_layout, frames, (views, bent))
    }

    /// See [`Session::encode`].
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (view, frame): (&BoundFrame, &FrameNumbers),
        timestamps: Option<Timestamps<'_>>,
    ) -> Result<()> {
        view.begin(&self.host.queue, &self.program, frame)?;
        self.chain.encode(encoder, view, timestamps);
        Ok(())
    }
}
