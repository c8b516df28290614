//! Classic methods on a device, beside the networks: same textures, same verbs.

use crate::error::Result;
use crate::frame::size::Size;
use crate::gpu::wgpu_30::options::{Options, Outputs, bent_encoding};
use crate::gpu::wgpu_30::session::Session;
use crate::search::gpu::method::Method;
use crate::search::{ArcsParams, Classic};

impl Session<Method> {
    /// A session for frames of `size`. Precision and kernels of the options do not matter.
    ///
    /// # Errors
    /// When the method is NNAO or a parameter is out of its range, when a side is too large for the device, or the
    /// device lacks what WebGPU promises or does not have enough memory.
    pub fn new(
        on: (&wgpu::Device, &wgpu::Queue),
        method: &Classic,
        size: Size,
        options: Options,
    ) -> Result<Self> {
        Self::of(on, Method::new(method, options.textures())?, size, options.output)
    }

    /// A session that writes bent normals as well, to a texture of the format `bent`: unit vectors in view space as they are in
    /// `Rgba16Float` and `Rgba32Float`, as n/2 + 1/2 in `Rgba8Unorm`, `Bgra8Unorm` and `Rgb10a2Unorm`. Alpha is 1; the background is 0 in
    /// all channels. Frames are bound with [`Session::bind_with_bent_normals`].
    ///
    /// # Errors
    /// As [`Session::new`], when the method has no bent normals, as only GTAO, attenuated GTAO and connected arcs have, and when the
    /// format is another one.
    pub fn with_bent_normals(
        on: (&wgpu::Device, &wgpu::Queue),
        method: &Classic,
        size: Size,
        options: Options,
        bent: wgpu::TextureFormat,
    ) -> Result<Self> {
        let method = Method::with_bent_normals(method, options.textures(), bent_encoding(bent)?)?;
        Self::of(on, method, size, Outputs { visibility: options.output, bent: Some(bent) })
    }

    /// A session that draws the shares of light that connected arcs find, as [`Method::shares`] describes. The format of the options
    /// has three channels at least, such as `Rgba8Unorm`.
    ///
    /// # Errors
    /// As [`Session::new`].
    pub fn shares(
        on: (&wgpu::Device, &wgpu::Queue),
        params: &ArcsParams,
        size: Size,
        options: Options,
    ) -> Result<Self> {
        Self::of(on, Method::shares(params, options.textures())?, size, options.output)
    }
}
