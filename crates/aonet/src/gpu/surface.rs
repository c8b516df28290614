//! What every shader that sees a frame begins with.

use super::options::{DepthEncoding, NormalEncoding, Options, Precision};
use super::shader::Shader;

/// What every shader that sees the frame begins with.
pub(crate) fn surface(precision: Precision, options: &Options) -> Shader {
    let normals = match options.normals {
        NormalEncoding::Plain => 0,
        NormalEncoding::Unorm => 1,
        NormalEncoding::Octahedral => 2,
        NormalEncoding::OctahedralUnorm => 3,
    };
    let (depth, farthest) = match options.depth {
        DepthEncoding::Linear => (0, f32::MAX),
        DepthEncoding::Reversed => (1, 0.0),
        DepthEncoding::Standard => (1, 1.0),
    };
    Shader::new(precision)
        .number("UNORM_NORMALS", 1)
        .number("OCTAHEDRAL_NORMALS", 2)
        .number("OCTAHEDRAL_UNORM_NORMALS", 3)
        .number("NORMALS", normals)
        .number("LINEAR_DEPTH", 0)
        .number("DEPTH", depth)
        .float("FARTHEST", farthest)
        .part(include_str!("surface.wgsl"))
}
