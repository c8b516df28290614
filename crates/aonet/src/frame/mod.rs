//! What a frame is: the camera that saw it, its depth and normals, and its ambient occlusion.

pub mod ao_image;
pub mod camera;
mod check;
pub mod gbuffer;
pub mod layer;
pub mod size;
pub mod window;
