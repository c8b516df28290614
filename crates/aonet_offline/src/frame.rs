//! Frame files: one OpenEXR image a frame.

use crate::{Result, View};
use aonet::{AoImage, GBuffer};
use std::path::Path;

/// A G-buffer with what else its file holds.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Depth and shading normals, view space.
    pub gbuffer: GBuffer,
    /// HxW geometric normals, view space; zero on the background.
    pub geo_normal: Option<Vec<[f32; 3]>>,
    /// Reference AO.
    pub ao: Option<AoImage>,
    /// AO radius [world units] that belongs to the frame.
    pub radius: Option<f32>,
    /// The view that made the frame, where known.
    pub view: Option<View>,
}

/// What the caller says about a frame whose file does not say it (or says it wrong).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameHints {
    /// A whole view: camera and radius. Needed where normals are in world space.
    pub view: Option<View>,
    /// Vertical field of view [degrees].
    pub fov_y_deg: Option<f32>,
    /// AO radius [world units].
    pub radius: Option<f32>,
}

impl Frame {
    /// Reads a frame. `hints` win over what the file says.
    ///
    /// # Errors
    /// Names the file, what was expected and what was found.
    pub fn load(_path: &Path, _hints: &FrameHints) -> Result<Self> {
        unimplemented!()
    }

    /// Writes a frame under a temporary name, then renames it.
    ///
    /// # Errors
    /// When the file cannot be written; nothing is left behind then.
    pub fn save(&self, _path: &Path) -> Result<()> {
        unimplemented!()
    }
}
