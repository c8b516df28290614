//! How a session is built on a device.

use crate::error::{Error, Result};
use crate::gpu::matrices::Matrices;
use crate::gpu::options::{
    BentEncoding, DepthEncoding, Kernels, Layers, NormalEncoding, NormalSpace, Precision, ProgramOptions,
    TextureEncoding,
};
use crate::net::config::Features;

/// How a session is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Numbers to compute with.
    pub precision: Precision,
    /// Instructions to compute with.
    pub kernels: Kernels,
    /// Encoding of the normals.
    pub normals: NormalEncoding,
    /// Their space.
    pub normal_space: NormalSpace,
    /// Encoding of the depth.
    pub depth: DepthEncoding,
    /// Layers of depth that a frame has.
    pub layers: Layers,
    /// Format of the AO texture: one that can be rendered to and holds a float in its first channel, such as `R8Unorm`
    /// or `R16Float`.
    pub output: wgpu::TextureFormat,
}

/// Formats of the textures that a session writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Outputs {
    pub(crate) visibility: wgpu::TextureFormat,
    /// Of the bent normals, where there are some.
    pub(crate) bent: Option<wgpu::TextureFormat>,
}

impl From<wgpu::TextureFormat> for Outputs {
    fn from(visibility: wgpu::TextureFormat) -> Self {
        Self { visibility, bent: None }
    }
}

/// How a texture of the format holds bent normals.
///
/// # Errors
/// When it is none of the formats that can: of three or four channels, and rendered to on every device.
pub(crate) fn bent_encoding(format: wgpu::TextureFormat) -> Result<BentEncoding> {
    use wgpu::TextureFormat as Format;
    match format {
        Format::Rgba16Float | Format::Rgba32Float => Ok(BentEncoding::Plain),
        Format::Rgba8Unorm | Format::Bgra8Unorm | Format::Rgb10a2Unorm => Ok(BentEncoding::Unorm),
        other => {
            let expected = "Rgba16Float, Rgba32Float, Rgba8Unorm, Bgra8Unorm or Rgb10a2Unorm";
            Err(Error::value("format of bent normals", expected, format!("{other:?}")))
        }
    }
}

impl Default for Options {
    /// View-space normals as they are, one layer of reversed depth, 8 bits of visibility, half floats where there are some.
    fn default() -> Self {
        Self {
            precision: Precision::default(),
            kernels: Kernels::default(),
            normals: NormalEncoding::default(),
            normal_space: NormalSpace::default(),
            depth: DepthEncoding::default(),
            layers: Layers::default(),
            output: wgpu::TextureFormat::R8Unorm,
        }
    }
}

impl Options {
    /// What the frame's textures hold.
    pub(crate) fn textures(&self) -> TextureEncoding {
        let Self { normals, normal_space, depth, layers, .. } = *self;
        TextureEncoding { normals, normal_space, depth, layers }
    }

    /// The options of a program that a device can run, for a network that sees these features.
    pub(crate) fn on(&self, device: &wgpu::Device, features: &Features) -> ProgramOptions {
        let precision = self.precision.on(device, features);
        let kernels = self.kernels.on(device, precision);
        ProgramOptions { precision, kernels, textures: self.textures() }
    }
}

impl Precision {
    /// The precision that a session uses on this device: [`Precision::F32`] if the device lacks `SHADER_F16`, or if the network reads
    /// positions or depths in world units, which may not fit in 16 bits.
    pub fn on(self, device: &wgpu::Device, features: &Features) -> Self {
        match device.features().contains(wgpu::Features::SHADER_F16) {
            true => self.of(features),
            false => Self::F32,
        }
    }
}

impl Kernels {
    /// The kernels that a session uses on this device in this precision: matrices need [`Precision::F16`].
    pub fn on(self, device: &wgpu::Device, precision: Precision) -> Self {
        let has = |features| device.features().contains(features);
        let there = match self {
            Self::Plain => true,
            Self::Subgroups => has(wgpu::Features::SUBGROUP),
            Self::Matrices(_) => has(Matrices::FEATURES),
        };
        if there { self.of(precision) } else { Self::Plain }
    }
}
