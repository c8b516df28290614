//! How a program is built, and the parameters of a frame.

use crate::frame::ao_image::AoParams;
use crate::frame::camera::Camera;
use crate::gpu::matrices::Matrices;
use crate::net::config::{Channel, Features};
use serde::{Deserialize, Serialize};

/// Numbers that activations and weights are stored and multiplied in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// 32-bit floats, everywhere.
    F32,
    /// 16-bit floats where the device has `SHADER_F16` and the features of the network fit, else 32-bit ones. Long sums
    /// are added up in 32 bits. A session reports the precision that it uses.
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
    /// depends on the device: `aonet bench --device gpu` measures both. On an H100 this takes twice as long.
    Subgroups,
    /// As products of matrices if the precision is [`Precision::F16`] and the device was made with the features that these need; else as
    /// [`Kernels::Plain`].
    Matrices(Matrices),
}

impl Precision {
    /// Bytes of one activation or weight.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 => 2,
        }
    }

    /// The precision for a network that reads these features: 32 bits for positions and depths in world units, which may not fit in 16.
    pub(crate) fn of(self, features: &Features) -> Self {
        let fits = features.channels().iter().all(|channel| match channel {
            Channel::Normal(_) | Channel::NormalEncoded(_) => true,
            Channel::DepthNormalized | Channel::ProjectedRadius => true,
            Channel::HorizonOcclusion | Channel::Light(_) | Channel::SecondLayer => true,
            Channel::Position(_) | Channel::Depth => false,
        });
        if fits { self } else { Self::F32 }
    }
}

impl NormalEncoding {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Plain, Self::Unorm, Self::Octahedral, Self::OctahedralUnorm];
}

impl DepthEncoding {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Reversed, Self::Standard, Self::Linear];
}

impl Kernels {
    /// The kernels in this precision: products of matrices are of half floats.
    pub(crate) fn of(self, precision: Precision) -> Self {
        match self {
            Self::Matrices(_) if precision != Precision::F16 => Self::Plain,
            Self::Plain | Self::Subgroups | Self::Matrices(_) => self,
        }
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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

/// How a texture holds bent normals: unit vectors in view space, with an alpha of 1; all is 0 on the background.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BentEncoding {
    /// x, y and z as they are: `Rgba16Float`, `Rgba32Float`.
    #[default]
    Plain,
    /// n/2 + 1/2: `Rgba8Unorm`, `Bgra8Unorm`, `Rgb10a2Unorm`.
    Unorm,
}

/// The space that normals are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalSpace {
    /// The camera looks along -Z.
    #[default]
    View,
    /// The camera of a frame says where view space is.
    World,
}

/// How a texture holds depth: a depth texture or a float texture with one channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthEncoding {
    /// 1 at the near plane, 0 at the far plane and on the background.
    #[default]
    Reversed,
    /// 0 at the near plane, 1 at the far plane and on the background.
    Standard,
    /// Distance along -Z (world units); the background is infinite, NaN or not above 0.
    Linear,
}

/// How many layers of depth a program sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layers {
    /// The nearest surface of each pixel.
    #[default]
    One,
    /// A second surface behind it, in a texture of its own.
    Two,
}

impl Layers {
    /// Number of layers.
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
        }
    }

    fn is_one(&self) -> bool {
        *self == Self::One
    }
}

/// What the textures of a frame hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureEncoding {
    /// Encoding of the normals.
    pub normals: NormalEncoding,
    /// Their space.
    pub normal_space: NormalSpace,
    /// Encoding of the depth, in all layers.
    pub depth: DepthEncoding,
    /// Layers of depth.
    #[serde(default, skip_serializing_if = "Layers::is_one")]
    pub layers: Layers,
}

/// How a network's program is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProgramOptions {
    /// Numbers to compute with.
    pub precision: Precision,
    /// Instructions to compute with.
    pub kernels: Kernels,
    /// What the frame's textures hold.
    pub textures: TextureEncoding,
}

/// The parameters of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameNumbers {
    /// The camera that saw the frame; of the session's size. Its near plane counts for depth that is not linear, and its
    /// place for normals in world space.
    pub camera: Camera,
    /// Distance of the far plane (world units): infinite is allowed with perspective. Counts for depth that is not
    /// linear.
    pub far: f32,
    /// The AO radius.
    pub params: AoParams,
}
