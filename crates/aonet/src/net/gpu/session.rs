//! A model ready to run at one size.

use crate::error::Result;
use crate::frame::size::Size;
use crate::gpu::options::{Kernels, Precision};
use crate::gpu::wgpu_30::options::{Options, Outputs, bent_encoding};
use crate::gpu::wgpu_30::session::Session;
use crate::net::gpu::network::Network;
use crate::net::model::Model;

impl Session<Network> {
    /// A session for frames of `size`.
    ///
    /// # Errors
    /// When a side is too large for the device, or the device lacks what WebGPU promises or does not have enough
    /// memory.
    pub fn new(
        on: (&wgpu::Device, &wgpu::Queue),
        model: &Model,
        size: Size,
        options: Options,
    ) -> Result<Self> {
        let network = Network::new(model, options.on(on.0, &model.config().features))?;
        Self::of(on, network, size, options.output)
    }

    /// A session that writes bent normals as well: those of the network's search. The texture is that of
    /// [`ClassicSession::with_bent_normals`](crate::search::gpu::ClassicSession::with_bent_normals).
    ///
    /// # Errors
    /// As [`Session::new`], when the network has no search, and when the format is another one.
    pub fn with_bent_normals(
        on: (&wgpu::Device, &wgpu::Queue),
        model: &Model,
        size: Size,
        options: Options,
        bent: wgpu::TextureFormat,
    ) -> Result<Self> {
        let program = options.on(on.0, &model.config().features);
        let network = Network::with_bent_normals(model, program, bent_encoding(bent)?)?;
        Self::of(on, network, size, Outputs { visibility: options.output, bent: Some(bent) })
    }

    /// The numbers that it computes with: see [`Options::precision`].
    pub fn precision(&self) -> Precision {
        self.method.arithmetic.precision
    }

    /// The instructions that it computes with: see [`Options::kernels`].
    pub fn kernels(&self) -> Kernels {
        self.method.arithmetic.kernels
    }
}
