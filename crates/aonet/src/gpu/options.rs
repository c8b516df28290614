//! What a session is told once, and what it is told every frame.

use crate::frame::ao_image::AoParams;
use crate::frame::camera::Camera;
use crate::gpu::matrices::Matrices;
use crate::net::config::{Channel, Features};

/// Numbers that activations and weights are stored and multiplied in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// 32-bit floats, everywhere.
    F32,
    /// 16-bit floats where the device has `SHADER_F16` and the features of the network fit, else 32-bit ones. Long sums
    /// are added up in 32 bits. [`Session::precision`](super::Session::precision) says what it came to.
    #[default]
    F16,
}

/// How convolutions and heads are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kernels {
    /// With what every device has.
    #[default]
    Plain,
    /// Filters are read once a subgroup where the device has `SUBGROUP`, else as [`Kernels::Plain`]. Which of the two is faster
    /// depends on the device: `aonet bench --device gpu` tells.
    Subgroups,
    /// As products of matrices where the precision comes to half floats, and the device is one that was made with
    /// [`Matrices::FEATURES`]; else as [`Kernels::Plain`].
    Matrices(Matrices),
}

impl Precision {
    /// What it comes to on a device for a network that sees these features: positions and depths in world units may be
    /// anything, and do not fit in 16 bits.
    pub fn on(self, device: &wgpu::Device, features: Features) -> Self {
        let fits = features.channels().iter().all(|channel| match channel {
            Channel::Normal(_) | Channel::NormalEncoded(_) => true,
            Channel::DepthNormalized | Channel::ProjectedRadius | Channel::HorizonOcclusion => true,
            Channel::Position(_) | Channel::Depth => false,
        });
        match device.features().contains(wgpu::Features::SHADER_F16) && fits {
            true => self,
            false => Self::F32,
        }
    }
}

impl Kernels {
    /// What they come to on a device, for what the precision comes to there.
    pub fn on(self, device: &wgpu::Device, precision: Precision) -> Self {
        let has = |features| device.features().contains(features);
        let there = match self {
            Self::Plain => true,
            Self::Subgroups => has(wgpu::Features::SUBGROUP),
            Self::Matrices(_) => precision == Precision::F16 && has(Matrices::FEATURES),
        };
        if there { self } else { Self::Plain }
    }
}

impl std::fmt::Display for Kernels {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Plain => "plain",
            Self::Subgroups => "subgroups",
            Self::Matrices(_) => "matrices",
        })
    }
}

impl std::fmt::Display for Precision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
        })
    }
}

/// How a texture holds a normal. Any length but zero will do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalEncoding {
    /// x, y and z as they are: `Rgba16Float`, `Rgba32Float`, `Rgba8Snorm`.
    #[default]
    Plain,
    /// n/2 + 1/2 in three channels: `Rgb10a2Unorm`, `Rgba8Unorm`.
    Unorm,
    /// The unfolded octahedron in two channels from -1 to 1: `Rg16Float`, `Rg16Snorm`, `Rg8Snorm`.
    Octahedral,
    /// The same in two channels from 0 to 1: `Rg16Unorm`, `Rg8Unorm`.
    OctahedralUnorm,
}

/// The space that normals are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalSpace {
    /// The camera looks along -Z.
    #[default]
    View,
    /// The camera of a frame says where view space is.
    World,
}

/// How a texture holds depth: a depth texture or a float texture with one channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthEncoding {
    /// 1 at the near plane, 0 at the far plane and on the background.
    #[default]
    Reversed,
    /// 0 at the near plane, 1 at the far plane and on the background.
    Standard,
    /// Distance along -Z [world units]; the background is infinite, NaN or not above 0.
    Linear,
}

/// What a session is told once.
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
    /// Format of the AO texture: one that can be rendered to and holds a float in its first channel, such as `R8Unorm`
    /// or `R16Float`.
    pub output: wgpu::TextureFormat,
}

impl Default for Options {
    /// View-space normals as they are, reversed depth, 8 bits of visibility, half floats where there are some.
    fn default() -> Self {
        Self {
            precision: Precision::default(),
            kernels: Kernels::default(),
            normals: NormalEncoding::default(),
            normal_space: NormalSpace::default(),
            depth: DepthEncoding::default(),
            output: wgpu::TextureFormat::R8Unorm,
        }
    }
}

/// What a session is told every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The camera that saw the frame; of the session's size. Its near plane counts for depth that is not linear, and its
    /// place for normals in world space.
    pub camera: Camera,
    /// Distance of the far plane [world units]: infinite is allowed with perspective. Counts for depth that is not
    /// linear.
    pub far: f32,
    /// The AO radius.
    pub params: AoParams,
}
