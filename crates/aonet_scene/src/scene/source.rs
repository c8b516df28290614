//! The source of a scene, as manifests and command lines name it: a file or code.

use super::procedural::{self, Kind};
use super::{MissingNormals, Scene, gltf};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A scene by name: `path/to/file.glb`, `path/to/file.gltf`, `procedural:KIND:SEED` or `imported`. The text form parses back
/// to the same value.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum SceneSource {
    /// A glTF file.
    File(PathBuf),
    /// A procedural scene.
    Procedural {
        /// Its kind.
        kind: Kind,
        /// Seed of the variant.
        seed: u64,
    },
    /// None: another program made frames of it.
    Imported,
}

const PREFIX: &str = "procedural:";

const IMPORTED: &str = "imported";

/// What can be loaded.
const EXPECTED: &str = "a .glb or .gltf file, or procedural:KIND:SEED";

impl SceneSource {
    /// Reads or builds the scene. `missing` applies to files; procedural scenes have normals.
    ///
    /// # Errors
    /// As [`gltf::load`]; and when the scene is `imported`.
    pub fn load(&self, missing: MissingNormals) -> Result<Scene> {
        match self {
            Self::File(path) => gltf::load(path, missing),
            Self::Procedural { kind, seed } => Ok(procedural::build(*kind, *seed)),
            Self::Imported => {
                Err(Error::request("scene", EXPECTED, "imported frames, which have no triangles"))
            }
        }
    }
}

impl FromStr for SceneSource {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if let Some(rest) = text.strip_prefix(PREFIX) {
            return procedural_source(text, rest);
        }
        if text == IMPORTED {
            return Ok(Self::Imported);
        }
        let path = PathBuf::from(text);
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extension != "glb" && extension != "gltf" {
            return Err(Error::request("scene", EXPECTED, format!("{text:?}")));
        }
        Ok(Self::File(path))
    }
}

fn procedural_source(text: &str, kind_and_seed: &str) -> Result<SceneSource> {
    let parsed =
        kind_and_seed.split_once(':').and_then(|(kind, seed)| Some((kind.parse().ok()?, seed.parse().ok()?)));
    let (kind, seed) = parsed.ok_or_else(|| {
        let kinds: Vec<String> = Kind::ALL.iter().map(ToString::to_string).collect();
        let expected =
            format!("procedural:KIND:SEED with a seed of 64 bits and a kind of {}", kinds.join(", "));
        Error::request("scene", expected, format!("{text:?}"))
    })?;
    Ok(SceneSource::Procedural { kind, seed })
}

impl fmt::Display for SceneSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Procedural { kind, seed } => write!(f, "{PREFIX}{kind}:{seed}"),
            Self::Imported => f.write_str(IMPORTED),
        }
    }
}

impl TryFrom<String> for SceneSource {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<SceneSource> for String {
    fn from(source: SceneSource) -> Self {
        source.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_value_round_trip() {
        let kinds = Kind::ALL.iter().map(|kind| format!("procedural:{kind}:18446744073709551615"));
        for text in
            kinds.chain(["a.glb".into(), "imported".into(), "some folder/B.GLTF".into(), "/x/y.z.glb".into()])
        {
            let source: SceneSource = text.parse().unwrap();
            assert_eq!(source.to_string(), text);
            let json = serde_json::to_string(&source).unwrap();
            assert_eq!(json, format!("{text:?}"));
            assert_eq!(serde_json::from_str::<SceneSource>(&json).unwrap(), source);
        }
    }

    #[test]
    fn what_is_no_scene_is_told_what_is() {
        for text in ["", "a.obj", "glb", "procedural", "procedural:", "procedural:nothing:1"] {
            let message = text.parse::<SceneSource>().unwrap_err().to_string();
            assert!(message.contains("procedural:KIND:SEED"), "{text}: {message}");
        }
        let kind = Kind::ALL[0];
        for seed in ["", "-1", "1.5", "18446744073709551616", "1:2"] {
            let message = format!("procedural:{kind}:{seed}").parse::<SceneSource>().unwrap_err().to_string();
            assert!(message.contains(&kind.to_string()), "{seed}: {message}");
        }
    }

    #[test]
    fn loads_what_it_names() {
        let missing = std::path::Path::new("no").join("such.glb");
        let error = SceneSource::File(missing).load(MissingNormals::Flat).unwrap_err();
        assert!(error.to_string().contains("such.glb"), "{error}");
        let kind = Kind::ALL[0];
        let scene = SceneSource::Procedural { kind, seed: 7 }.load(MissingNormals::Flat).unwrap();
        assert_eq!(scene, procedural::build(kind, 7));
    }
}
