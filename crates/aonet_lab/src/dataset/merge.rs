//! Merges the shards of a dataset.

use super::manifest::Manifest;
use super::plan::Shard;
use aonet_scene::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Joins the shard manifests in `dirs` into `manifest.json` in the first of them. Frame files of the other
/// folders are copied there.
///
/// # Errors
/// When there are no shards, they do not belong together, one is missing, repeated or incomplete, a frame
/// file is missing, or the first folder holds another dataset.
pub fn merge(dirs: &[PathBuf]) -> Result<Manifest> {
    let mut shards = Vec::new();
    for dir in dirs {
        shards.extend(shard_manifests(dir)?);
    }
    let (Some(target), Some(first)) = (dirs.first(), shards.first()) else {
        let found = dirs.iter().map(|d| d.display().to_string()).collect::<Vec<_>>().join(", ");
        return Err(Error::request(
            "merge",
            "folders with manifest-I-of-N.json",
            format!("none in {found:?}"),
        ));
    };
    let mut whole = Manifest::new(target, first.plan.clone(), None);
    if target.join(Manifest::file_name(None)).exists() {
        Manifest::load(target)?.check_same(&whole)?;
    }
    let count = first.shard.map_or(1, |s| s.count);
    for index in 1..=count {
        let shard = Some(Shard::new(index, count)?);
        let mut of_index = shards.iter().filter(|m| m.shard == shard);
        let name = Manifest::file_name(shard);
        let Some(manifest) = of_index.next() else {
            return Err(Error::request("merge", name, "no such file in the given folders"));
        };
        if of_index.next().is_some() {
            return Err(Error::request("merge", format!("one {name}"), "several"));
        }
        manifest.check_same(&whole)?;
        if manifest.missing() > 0 {
            let found = format!("{} frames missing", manifest.missing());
            return Err(Error::file(&manifest.dir().join(name), "a complete shard", found));
        }
        for frame in &manifest.frames {
            bring(&manifest.path(frame), &target.join(&frame.file))?;
            whole.insert(frame.clone());
        }
    }
    if let Some(stray) = shards.iter().find(|m| m.shard.is_none_or(|s| s.count != count)) {
        let path = stray.dir().join(Manifest::file_name(stray.shard));
        return Err(Error::file(&path, format!("one of {count} shards"), "another number of shards"));
    }
    whole.save()?;
    Ok(whole)
}

fn shard_manifests(dir: &Path) -> Result<Vec<Manifest>> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(Error::io(dir))? {
        let path = entry.map_err(Error::io(dir))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with("manifest-") && name.ends_with(".json") {
            paths.push(path);
        }
    }
    paths.sort();
    paths.iter().map(|p| Manifest::load(p)).collect()
}

/// Copies a frame file unless the target exists.
fn bring(from: &Path, to: &Path) -> Result<()> {
    if from == to {
        return from.metadata().map(drop).map_err(Error::io(from));
    }
    let folder = to.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let bytes = std::fs::read(from).map_err(Error::io(from))?;
    aonet_scene::atomic_file::write(to, &bytes)
}
