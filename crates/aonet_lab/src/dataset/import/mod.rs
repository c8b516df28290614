//! Frames of other programs as a dataset: three folders of OpenEXR images, of normals, depth and AO.
//!
//! The layout of DeepAO's data (Zhang et al. 2020): view-space normals n as colours n/2 + 1/2, distances along the
//! viewing axis that are not normalised, and visibility. Which files belong together is in [`Import`].

mod pairs;
#[cfg(test)]
mod tests;
mod triple;

use super::generate::{Event, SAVE_EVERY};
use super::imported::{ImportRule, ImportedFrom, NormalCoding};
use super::manifest::{FrameEntry, Manifest};
use super::plan::{Counts, DatasetParams, DatasetPlan, Job, Preset};
use super::split::Split;
use aonet::AoParams;
use aonet_scene::error::{Error, Result};
use aonet_scene::staging::{RadiusRule, SceneSpec, SceneSplit, is_name_char};
use pairs::{Pairs, Triple, pair};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The scene of files that are not in a subfolder.
const FLAT: &str = "imported";

/// Treatment of a file whose name is not in all three folders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unmatched {
    /// It is an error.
    Refuse,
    /// It is left out.
    Skip,
}

/// What to import, and how.
///
/// A frame is three `.exr` files with one name: their path below the three folders without the extension. Where names
/// differ, the word that all files of a folder share is removed: a last `_word` of letters (`0001_normal`,
/// `0001_depth`), else a first `word_`; `-` and `.` separate words like `_`. If the first part of the name
/// is a folder, it is the scene, else the scene is `imported`. Names that begin with a dot are ignored.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// Folder of the normals, in view space: +X right, +Y up, +Z towards the camera.
    pub normal: PathBuf,
    /// Folder of the distances along the viewing axis (world units); their sign is ignored.
    pub depth: PathBuf,
    /// Folder of the visibility, 1 open and 0 closed.
    pub ao: PathBuf,
    /// How they are read.
    pub rule: ImportRule,
    /// AO radius of every frame (world units).
    pub radius: f32,
    /// The split of all frames.
    pub split: SceneSplit,
    /// Whether files without partners are an error.
    pub unmatched: Unmatched,
}

/// Summary of an import.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImportSummary {
    /// Frames imported.
    pub made: usize,
    /// Frames kept from an earlier run.
    pub kept: usize,
    /// Files that had no partners.
    pub skipped: usize,
}

/// Writes every frame of `wanted` that `dir` does not hold yet, and the manifest.
///
/// It can be killed at any moment and run again, like [`generate`](super::generate). Background is where the depth is
/// 0, not finite or at least 1e9 (in half floats 65504), and where the normal is shorter than one half or
/// stored as zero.
///
/// # Errors
/// Names the file, what was expected and what was found: a folder has no images or a file has no partners, an image is
/// broken or of the wrong size or channels, normals are not stored as the rule says or are not in view space,
/// visibility is not within [0, 1]. Also when a number is out of range, `dir` holds another dataset, or a file cannot be
/// written.
pub fn import(dir: &Path, wanted: &Import, on_event: &dyn Fn(Event)) -> Result<ImportSummary> {
    AoParams::new(wanted.radius)?;
    let Pairs { triples, skipped } = pair([&wanted.normal, &wanted.depth, &wanted.ao], wanted.unmatched)?;
    let plan = plan(wanted, &triples)?;
    let jobs = jobs(&plan, &triples);
    let mut manifest = resume(dir, &plan, &jobs)?;
    let done: BTreeSet<String> = manifest.frames.iter().map(|f| f.file.clone()).collect();
    on_event(Event::Resume { done: done.len(), total: jobs.len() });
    let missing: Vec<_> = jobs.iter().filter(|(file, _)| !done.contains(*file)).collect();
    let mut saved = Instant::now();
    for batch in missing.chunks(rayon::current_num_threads()) {
        let entries = batch
            .par_iter()
            .map(|(file, (job, triple))| bring(dir, wanted, &plan, &Source { file, job: *job, triple }));
        for entry in entries.collect::<Result<Vec<_>>>()? {
            on_event(Event::Frame(&entry));
            manifest.insert(entry);
        }
        if saved.elapsed() > SAVE_EVERY {
            manifest.save()?;
            saved = Instant::now();
        }
    }
    manifest.save()?;
    Ok(ImportSummary { made: missing.len(), kept: done.len(), skipped })
}

/// The plan of a dataset of these files.
fn plan(wanted: &Import, triples: &[Triple]) -> Result<DatasetPlan> {
    let folders: BTreeSet<Option<&str>> = triples.iter().map(|t| folder(&t.name)).collect();
    let scenes = folders.into_iter().map(|f| SceneSpec::imported(scene_name(f), wanted.split)).collect();
    let mut recipe = DatasetParams::preset(Preset::Imported(wanted.rule));
    let size = triple::size(&triples[0].files[0])?;
    (recipe.width, recipe.height) = (size.width(), size.height());
    recipe.radius = RadiusRule::Given(wanted.radius);
    let of = |split| if wanted.split == split { triples.len() as u32 } else { 0 };
    let [train, val, test] = [of(SceneSplit::Train), of(SceneSplit::Val), of(SceneSplit::Test)];
    recipe.frames = Counts { train, val, val_seen: 0, test };
    DatasetPlan::new(recipe, scenes)
}

/// The folder that a name begins with.
fn folder(name: &str) -> Option<&str> {
    name.split_once('/').map(|(folder, _)| folder)
}

fn scene_name(folder: Option<&str>) -> String {
    folder.unwrap_or(FLAT).replace(|c| !is_name_char(c), "_")
}

/// The frame of every triple, by the frame's file.
type Jobs<'a> = BTreeMap<String, (Job, &'a Triple)>;

/// The frames of a scene are in the order of their names.
fn jobs<'a>(plan: &DatasetPlan, triples: &'a [Triple]) -> Jobs<'a> {
    let mut next_index = vec![0; plan.scenes.len()];
    let job = |triple: &'a Triple| {
        let name = scene_name(folder(&triple.name));
        let scene = plan.scenes.iter().position(|s| s.name == name).expect("a scene for every folder");
        let index = next_index[scene];
        next_index[scene] += 1;
        let job = Job { scene, index, split: Split::of(plan.scenes[scene].split) };
        (plan.file(job), (job, triple))
    };
    triples.iter().map(job).collect()
}

/// The manifest of an earlier run of the same import without the frames whose files are gone, or a new one.
fn resume(dir: &Path, plan: &DatasetPlan, jobs: &Jobs) -> Result<Manifest> {
    let mut manifest = Manifest::new(dir, plan.clone(), None);
    let path = dir.join(Manifest::file_name(None));
    if !path.exists() {
        return Ok(manifest);
    }
    let found = Manifest::load(&path)?;
    found.check_same(&manifest)?;
    for frame in found.frames {
        let wanted = jobs.get(&frame.file).map(|(_, triple)| triple.source());
        if frame.source != wanted {
            let describe = |source: &Option<ImportedFrom>| match source {
                Some(ImportedFrom { name, bytes: [normal, depth, ao] }) => {
                    format!("{name} of {normal}, {depth} and {ao} bytes")
                }
                None => "nothing".into(),
            };
            let expected = format!("{} imported from {}", frame.file, describe(&wanted));
            return Err(Error::file(&path, expected, describe(&frame.source)));
        }
        if dir.join(&frame.file).is_file() {
            manifest.frames.push(frame);
        }
    }
    Ok(manifest)
}

/// A frame to write, and the files that it comes from.
struct Source<'a> {
    /// The frame's file, relative to the manifest.
    file: &'a str,
    job: Job,
    triple: &'a Triple,
}

/// Writes the frame of a triple.
fn bring(dir: &Path, wanted: &Import, plan: &DatasetPlan, source: &Source<'_>) -> Result<FrameEntry> {
    let &Source { file, job, triple } = source;
    let (frame, view) = triple::read(&triple.files, wanted)?;
    let path = dir.join(file);
    let folder = path.parent().unwrap_or(dir);
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    frame.save(&path)?;
    Ok(FrameEntry {
        file: file.to_owned(),
        scene: plan.scenes[job.scene].name.clone(),
        index: job.index,
        split: job.split,
        radius: view.radius,
        spp: 0,
        seed: 0,
        view,
        source: Some(triple.source()),
    })
}
