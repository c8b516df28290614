//! What a frame is: the camera that saw it, its depth and normals, and its ambient occlusion.

pub mod ao_image;
pub mod camera;
pub mod gbuffer;
pub mod size;
pub mod window;
