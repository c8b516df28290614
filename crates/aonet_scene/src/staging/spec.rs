//! The scenes of a dataset: where they come from and how they are prepared.

use crate::Scene;
use crate::error::{Error, Result};
use crate::scene::procedural::Kind;
use crate::scene::{MissingNormals, SceneSource, ground};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// A camera that came with a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Position (world units).
    pub eye: [f32; 3],
    /// Point looked at (world units).
    pub target: [f32; 3],
}

/// The split of all frames of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneSplit {
    /// Training, and validation on seen scenes.
    Train,
    /// Validation.
    Val,
    /// Test.
    Test,
}

impl SceneSplit {
    /// The name in manifests and commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }
}

/// One scene of a dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneSpec {
    /// Its name, and that of the folder of its frames.
    pub name: String,
    /// Its source; a file without its folder, because manifests are moved between machines.
    pub source: SceneSource,
    /// SHA-256 of the file, hexadecimal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// If the file has no normals: they are smooth across edges that bend less than this (degrees).
    pub crease_deg: f32,
    /// The split of its frames.
    pub split: SceneSplit,
    /// Whether a camera can stand inside, instead of around a single object.
    pub environment: bool,
    /// Whether a ground plane is added below it.
    pub ground: bool,
    /// Cameras that came with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Candidate>,
    /// Folder of the file on this machine; empty in a manifest that was read.
    #[serde(skip)]
    dir: PathBuf,
}

impl SceneSpec {
    /// A single object from a glTF file, named like the file.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn from_file(path: &Path, split: SceneSplit) -> Result<Self> {
        let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let name = text(path.file_stem()).replace(|c| !is_name_char(c), "_");
        let mut scene = Self::new(name, text(path.file_name()).parse()?, split);
        scene.sha256 = Some(sha256(path)?);
        scene = scene.located(path.parent().unwrap_or(Path::new("")));
        scene.check()?;
        Ok(scene.with_environment(false))
    }

    /// A procedural scene, named after its kind and seed. It contains its own ground.
    pub fn procedural(kind: Kind, seed: u64, split: SceneSplit) -> Self {
        Self::new(format!("{kind}_{seed}"), SceneSource::Procedural { kind, seed }, split)
    }

    /// A scene that is known only by frames of another program.
    pub fn imported(name: String, split: SceneSplit) -> Self {
        Self::new(name, SceneSource::Imported, split)
    }

    fn new(name: String, source: SceneSource, split: SceneSplit) -> Self {
        let (environment, ground, cameras) = (true, false, Vec::new());
        Self {
            name,
            source,
            sha256: None,
            crease_deg: 40.0,
            split,
            environment,
            ground,
            cameras,
            dir: PathBuf::new(),
        }
    }

    /// Returns the scene as an interior, or as an object on the ground.
    pub fn with_environment(self, environment: bool) -> Self {
        Self { environment, ground: !environment, ..self }
    }

    /// Returns the scene with its file in `dir`.
    pub fn located(self, dir: &Path) -> Self {
        Self { dir: dir.to_owned(), ..self }
    }

    /// Checks name, file, crease angle and cameras.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn check(&self) -> Result<()> {
        let safe =
            !self.name.is_empty() && !self.name.starts_with('.') && self.name.chars().all(is_name_char);
        if !safe || self.name.len() > 200 {
            let expected = "1 to 200 letters, digits, '_', '-' or '.', not '.' first";
            return Err(Error::request("scene name", expected, format!("{:?}", self.name)));
        }
        if let SceneSource::File(file) = &self.source
            && file.file_name() != Some(file.as_os_str())
        {
            let what = format!("file of scene {}", self.name);
            return Err(Error::request(what, "a name without a folder", file.display()));
        }
        if !(0.0..=180.0).contains(&self.crease_deg) {
            let what = format!("crease angle of scene {}", self.name);
            return Err(Error::request(what, "0 to 180 degrees", self.crease_deg));
        }
        let finite = |c: &Candidate| c.eye.iter().chain(&c.target).all(|v| v.is_finite());
        if !self.cameras.iter().all(|c| finite(c) && c.eye != c.target) {
            let what = format!("cameras of scene {}", self.name);
            return Err(Error::request(
                what,
                "finite positions, eye != target",
                format!("{:?}", self.cameras),
            ));
        }
        Ok(())
    }

    /// The triangles, and how many of them are not ground.
    ///
    /// # Errors
    /// When the file cannot be read, or differs from the planned one.
    pub fn load(&self) -> Result<(Scene, usize)> {
        let source = match &self.source {
            SceneSource::File(file) => {
                let path = self.dir.join(file);
                let found = sha256(&path)?;
                if self.sha256.as_ref() != Some(&found) {
                    return Err(Error::file(&path, format!("SHA-256 {:?}", self.sha256), found));
                }
                SceneSource::File(path)
            }
            SceneSource::Procedural { .. } | SceneSource::Imported => self.source.clone(),
        };
        let mut scene = source.load(MissingNormals::Crease { angle_deg: self.crease_deg })?;
        turn_to_normals(&mut scene);
        let content = scene.triangle.len();
        if self.ground {
            ground::add_ground(&mut scene);
        }
        Ok((scene, content))
    }
}

/// Whether a scene's name may contain the character.
pub fn is_name_char(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_-.".contains(c)
}

/// Flips triangles whose winding contradicts their vertex normals. Exporters produce them when they mirror parts, and
/// their visible side would be shaded with a normal that points away from the viewer.
fn turn_to_normals(scene: &mut Scene) {
    for triangle in &mut scene.triangle {
        let [a, b, c] = triangle.map(|i| scene.position[i as usize].as_dvec3());
        let shading: DVec3 = triangle.iter().map(|&i| scene.normal[i as usize].as_dvec3()).sum();
        if (b - a).cross(c - a).dot(shading) < 0.0 {
            triangle.swap(1, 2);
        }
    }
}

fn sha256(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    Ok(Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect())
}
