//! What a frame is: the camera that saw it, its depth and normals, and its ambient occlusion.

pub mod ao_image;
pub mod camera;
mod check;
pub mod gbuffer;
pub mod layer;
pub mod size;
pub mod window;

/// Depth of the background where it has to be a number that can be computed with: beyond every scene, and squares of what comes
/// of it are still floats.
pub(crate) const BACKGROUND: f32 = 1e16;
