//! Exact shares of light of the frames of a dataset, in a folder of their own: what a search would find that misses nothing.

use crate::dataset::{FrameEntry, Manifest};
use crate::exr_file::{Plane, encode_images};
use aonet::Size;
use aonet::search::Share;
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use aonet_scene::exact_shares::{ExactShares, exact_shares};
use aonet_scene::reference::Sampling;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use exr::prelude::FlatSamples;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a frame shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// The picture's first layer alone.
    OneLayer,
    /// All that the dataset's frames have.
    Whole,
}

impl Extent {
    const ALL: [Self; 2] = [Self::OneLayer, Self::Whole];

    const fn folder(self) -> &'static str {
        match self {
            Self::OneLayer => "one_layer",
            Self::Whole => "whole",
        }
    }

    /// The file of a frame's shares.
    pub(crate) fn file(self, dir: &Path, entry: &FrameEntry) -> PathBuf {
        dir.join(self.folder()).join(&entry.file)
    }
}

/// Writes the exact shares of every `every`-th pixel of every `every`-th row of each frame, for both [extents](Extent), below `dir`; files
/// that are there already are kept. `progress` is called once a frame.
///
/// # Errors
/// When a scene or a view cannot be read, the dataset has no frame of its scenes, or a file cannot be written.
pub fn save_all(
    manifest: &Manifest,
    scenes: &Path,
    (dir, every, spp): (&Path, usize, u32),
    progress: &dyn Fn(),
) -> Result<()> {
    let plan = manifest.plan.located(scenes);
    if !manifest.frames.iter().any(|entry| plan.scenes.iter().any(|spec| spec.name == entry.scene)) {
        return Err(Error::request("dataset", "frames of scenes that it lists", "none"));
    }
    for spec in &plan.scenes {
        let is_missing =
            |entry: &&FrameEntry| Extent::ALL.iter().any(|extent| !extent.file(dir, entry).exists());
        let frames: Vec<_> = manifest.frames.iter().filter(|entry| entry.scene == spec.name).collect();
        let missing: Vec<_> = frames.iter().copied().filter(is_missing).collect();
        (missing.len()..frames.len()).for_each(|_| progress());
        if missing.is_empty() {
            continue;
        }
        let tracer = Tracer::new(spec.load()?.0);
        for entry in missing {
            let kinds = [Surround::default(), manifest.plan.recipe.surround];
            // Other rays than those of the reference.
            let sampling = Sampling { spp, seed: entry.seed ^ 1 };
            let (size, found) = exact_shares(&tracer, &entry.view, &kinds, (sampling, every))?;
            for (extent, shares) in Extent::ALL.iter().zip(found) {
                save(&extent.file(dir, entry), size, shares)?;
            }
            progress();
        }
    }
    Ok(())
}

fn save(path: &Path, size: Size, shares: ExactShares) -> Result<()> {
    let [_, found @ ..] = Share::ALL;
    let plane =
        |(share, values): (Share, Vec<f32>)| Plane { name: share.name(), samples: FlatSamples::F32(values) };
    let planes = found.into_iter().zip(shares).map(plane).collect();
    let bytes = encode_images(size, planes).map_err(Error::in_file(path))?;
    let folder = path.parent().expect("a file of a dataset is in a folder");
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    atomic_file::write(path, &bytes)
}
