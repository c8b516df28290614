//! What a manifest records about frames that another program made.

use aonet_scene::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// How a file stores a normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalCoding {
    /// As a colour, n/2 + 1/2.
    Encoded,
    /// As a vector.
    Plain,
}

/// How the images of an import are read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImportRule {
    /// Vertical field of view of every frame (degrees).
    pub fov_y_deg: f32,
    /// How normals are stored.
    pub normals: NormalCoding,
}

impl ImportRule {
    pub(super) fn check(self) -> Result<()> {
        if self.fov_y_deg > 0.0 && self.fov_y_deg < 180.0 {
            return Ok(());
        }
        Err(Error::request("field of view", "an angle in (0, 180) degrees", self.fov_y_deg))
    }
}

/// What an imported frame was read from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImportedFrom {
    /// The name that its files share.
    pub name: String,
    /// Lengths of the files of normals, depth and AO (bytes).
    pub bytes: [u64; 3],
}
