//! The scenes of a dataset: where they come from and how they are prepared.

use super::plan::SceneSplit;
use crate::Scene;
use crate::error::{Error, Result};
use crate::scene::normals::MissingNormals;
use crate::scene::{gltf, ground, procedural};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Where the triangles of a scene come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// A glTF file.
    File {
        /// Its name, without the folder: manifests travel between machines.
        file: String,
        /// SHA-256 of its bytes, hexadecimal.
        sha256: String,
        /// Where the file has no normals, they are smooth across edges below this angle [degrees].
        crease_deg: f32,
        /// Where it is on this machine; empty in a manifest that was read.
        #[serde(skip)]
        path: PathBuf,
    },
    /// Made from code.
    Procedural {
        /// Which generator.
        kind: String,
        /// Its seed.
        seed: u64,
    },
}

/// A camera that came with a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Position [world units].
    pub eye: [f32; 3],
    /// Point looked at [world units].
    pub target: [f32; 3],
}

/// One scene of a dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneSpec {
    /// Its name, and that of the folder of its frames.
    pub name: String,
    /// Where it comes from.
    pub origin: Origin,
    /// What its frames are for.
    pub split: SceneSplit,
    /// Whether a camera can stand inside, instead of around a single object.
    pub environment: bool,
    /// Whether a ground plane is put under it.
    pub ground: bool,
    /// Cameras that came with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Candidate>,
}

impl SceneSpec {
    /// A single object from a glTF file, named like the file.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn from_file(path: &Path, split: SceneSplit) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let sha256 = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
        let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let origin = Origin::File { file: text(path.file_name()), sha256, crease_deg: 40.0, path: path.to_owned() };
        let name = text(path.file_stem()).replace(|c| !is_name_char(c), "_");
        Self { name, origin, split, environment: false, ground: true, cameras: Vec::new() }.checked()
    }

    /// A scene made from code, named after its kind and seed.
    ///
    /// # Errors
    /// When there is no such kind.
    pub fn procedural(kind: &str, seed: u64, split: SceneSplit) -> Result<Self> {
        procedural_kind(kind)?;
        let origin = Origin::Procedural { kind: kind.to_owned(), seed };
        let name = format!("{kind}_{seed}");
        Self { name, origin, split, environment: true, ground: false, cameras: Vec::new() }.checked()
    }

    /// The same scene as something to stand inside, or as an object on the ground.
    pub fn with_environment(self, environment: bool) -> Self {
        Self { environment, ground: !environment, ..self }
    }

    fn checked(self) -> Result<Self> {
        self.check().map(|()| self)
    }

    pub(super) fn check(&self) -> Result<()> {
        let safe = !self.name.is_empty() && !self.name.starts_with('.') && self.name.chars().all(is_name_char);
        if !safe || self.name.len() > 200 {
            let expected = "1 to 200 letters, digits, '_', '-' or '.', not '.' first";
            return Err(Error::request("scene name", expected, format!("{:?}", self.name)));
        }
        let finite = |c: &Candidate| c.eye.iter().chain(&c.target).all(|v| v.is_finite());
        if !self.cameras.iter().all(|c| finite(c) && c.eye != c.target) {
            let what = format!("cameras of scene {}", self.name);
            return Err(Error::request(what, "finite positions, eye != target", format!("{:?}", self.cameras)));
        }
        Ok(())
    }

    /// The triangles, and how many of them are not ground.
    ///
    /// # Errors
    /// When the file cannot be read, or is not the one that was planned with.
    pub(super) fn load(&self) -> Result<(Scene, usize)> {
        let mut scene = match &self.origin {
            Origin::File { sha256, crease_deg, path, .. } => {
                let now = Self::from_file(path, self.split)?;
                if !matches!(&now.origin, Origin::File { sha256: s, .. } if s == sha256) {
                    return Err(Error::file(path, format!("SHA-256 {sha256}"), "another file"));
                }
                gltf::load(path, MissingNormals::Crease { angle_deg: *crease_deg })?
            }
            Origin::Procedural { kind, seed } => procedural::build(procedural_kind(kind)?, *seed),
        };
        let content = scene.triangle.len();
        if self.ground {
            ground::add_ground(&mut scene);
        }
        Ok((scene, content))
    }
}

fn is_name_char(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_-.".contains(c)
}
