//! A classic method with parameters found by a search, and how they were found: a JSON file.

use aonet::search::Classic;
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Tuned parameters of a method, and how they were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    /// The method and its parameters.
    pub method: Classic,
    /// The command that found them.
    #[serde(default)]
    pub command: String,
    /// The data that they were tuned on.
    #[serde(default)]
    pub frames: String,
}

impl Preset {
    /// Reads a preset.
    ///
    /// # Errors
    /// When the file cannot be read, is no preset, or a parameter is out of its range.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_bytes(&std::fs::read(path).map_err(Error::io(path))?, path)
    }

    /// The preset in a file's bytes; `path` names it in errors.
    ///
    /// # Errors
    /// When they are no preset, or a parameter is out of its range.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let preset: Self =
            serde_json::from_slice(bytes).map_err(|e| Error::file(path, "parameters of a method", e))?;
        preset.method.checked().map_err(Error::in_file(path))?;
        Ok(preset)
    }

    /// Writes it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::file(path, "JSON", e))?;
        atomic_file::write(path, format!("{text}\n").as_bytes())
    }
}
