//! Primary rays through pixel centres: the G-buffer of a view.

use crate::trace::Tracer;
use crate::{Result, View};
use aonet::GBuffer;

/// What primary rays found: the G-buffer, and what only the reference may know.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Depth and shading normals, view space.
    pub gbuffer: GBuffer,
    /// HxW geometric normals, view space, towards the viewer; zero on the background.
    pub geo_normal: Vec<[f32; 3]>,
    /// HxW whether the visible side is the back of its triangle by winding; false on the background.
    pub backface: Vec<bool>,
}

/// Casts one ray a pixel on all cores.
///
/// # Errors
/// When the view's camera or radius is out of range.
pub fn render(_tracer: &Tracer, _view: &View) -> Result<Surface> {
    unimplemented!()
}
