//! What every shader that sees a frame begins with.

use super::options::{DepthEncoding, Layers, NormalEncoding, Precision, TextureEncoding};
use super::shader::{Shader, constant, decimal};
use crate::frame::BACKGROUND;

/// WGSL of what shaders compute with the numbers of [`Lens`](super::uniforms::Lens): distances of stored depths, and positions of
/// pixels.
pub const LENS: &str = include_str!("lens.wgsl");

/// How a shader that sees a frame computes, and what the frame's textures hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Surface {
    pub(crate) precision: Precision,
    pub(crate) textures: TextureEncoding,
}

impl Surface {
    /// The beginning of such a shader.
    pub(crate) fn shader(self) -> Shader {
        Shader::new(self.precision)
            .number("UNORM_NORMALS", 1)
            .number("OCTAHEDRAL_NORMALS", 2)
            .number("OCTAHEDRAL_UNORM_NORMALS", 3)
            .part(&normal_lines(self.textures.normals))
            .number("LINEAR_DEPTH", 0)
            .part(&depth_lines(self.textures.depth))
            .float("BACKGROUND", BACKGROUND)
            .number("LAYERS", self.textures.layers.count())
            .part(include_str!("surface.wgsl"))
            .part(match self.textures.layers {
                Layers::One => include_str!("one_layer.wgsl"),
                Layers::Two => include_str!("two_layers.wgsl"),
            })
            .part(LENS)
    }
}

/// The line of a shader that says how normals are stored.
pub(crate) fn normal_lines(normals: NormalEncoding) -> String {
    let number = match normals {
        NormalEncoding::Plain => 0,
        NormalEncoding::Unorm => 1,
        NormalEncoding::Octahedral => 2,
        NormalEncoding::OctahedralUnorm => 3,
    };
    constant("NORMALS", ("u32", format!("{number}u")))
}

/// The lines of a shader that say how depth is stored.
pub(crate) fn depth_lines(depth: DepthEncoding) -> String {
    let (number, farthest) = match depth {
        DepthEncoding::Linear => (0, f32::MAX),
        DepthEncoding::Reversed => (1, 0.0),
        DepthEncoding::Standard => (1, 1.0),
    };
    [constant("DEPTH", ("u32", format!("{number}u"))), constant("FARTHEST", ("f32", decimal(farthest)))]
        .join("\n")
}
