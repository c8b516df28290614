//! What a frame is: the camera that saw it, its depth and normals, and its ambient occlusion. The types that every program needs
//! are at the root of the crate; [`Camera`](crate::Camera) describes which engine has which matrix.

pub(crate) mod ao_image;
pub(crate) mod bent_normals;
pub(crate) mod camera;
mod check;
pub(crate) mod coarse;
pub(crate) mod gbuffer;
mod layer;
pub(crate) mod size;
pub(crate) mod window;

pub use camera::ClipDepth;
pub use layer::{FrameMemory, Numbers, Pixels};
pub use size::MAX_SIDE;

/// Depth of the background where it has to be a number that can be computed with: beyond every scene, and squares of what comes
/// of it are still floats.
pub(crate) const BACKGROUND: f32 = 1e16;
