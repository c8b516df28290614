//! Making the frames of a plan: resumable, in shards, one scene in memory at a time.

use super::manifest::{FrameEntry, Manifest};
use super::plan::{DatasetPlan, Job, Shard};
use crate::frame::Frame;
use aonet_scene::backend::{Backend, Rays};
use aonet_scene::error::{Error, Result};
use aonet_scene::gbuffer;
use aonet_scene::random::Random;
use aonet_scene::reference::Sampling;
use aonet_scene::staging::Flaw;
use aonet_scene::staging::Stage;
use aonet_scene::trace::Tracer;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two writes of a manifest; a killed run loses the record of at most this much work.
pub(super) const SAVE_EVERY: Duration = Duration::from_secs(5);

/// Which frames of a plan to make, and on which device.
#[derive(Debug, Clone, Default)]
pub struct Work {
    /// The shard to make; all frames if absent.
    pub shard: Option<Shard>,
    /// The backend that traces their reference.
    pub backend: Backend,
}

/// What happens while frames are made.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// Number of frames at the start and at the end.
    Resume {
        /// Complete from an earlier run.
        done: usize,
        /// All frames of the plan, or of the shard.
        total: usize,
    },
    /// The scene of the next frames.
    Scene(&'a str),
    /// This many more reference rays were traced.
    Rays(u64),
    /// A frame is complete.
    Frame(&'a FrameEntry),
}

/// Summary of a run.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Frames made.
    pub made: usize,
    /// Made frames whose views were chosen, not given.
    pub chosen: usize,
    /// Frames kept from an earlier run.
    pub kept: usize,
    /// Number of proposed views dropped for each flaw.
    pub flaws: BTreeMap<Flaw, usize>,
}

impl Summary {
    /// Share of the proposed views that became frames; 1 when none were proposed.
    pub fn acceptance(&self) -> f32 {
        let dropped: usize = self.flaws.values().sum();
        if self.chosen == 0 { 1.0 } else { self.chosen as f32 / (self.chosen + dropped) as f32 }
    }
}

/// Makes the frames of a plan, or of a shard of it, that `dir` does not hold yet, and its manifest.
///
/// It can be killed at any moment and run again: complete frames are kept, others are made again. Equal
/// plans give equal bytes, whatever the shards, interruptions and number of threads. A GPU rounds some rays differently.
///
/// # Errors
/// When `dir` holds frames of another plan, a scene cannot be read or shows nothing worth keeping, a
/// file cannot be written, or the plan is of imported frames.
pub fn generate(
    dir: &Path,
    plan: &DatasetPlan,
    work: &Work,
    on_event: &(dyn Fn(Event) + Sync),
) -> Result<Summary> {
    run(resume(dir, plan, work.shard)?, &BTreeMap::new(), (&work.backend, on_event))
}

/// Makes a dataset again in `dir` from its manifest: the same views with the same rays, so the same bytes,
/// even if a later program would choose other views. Frames that `original` lacks are chosen now. The plan of `original` gives
/// where the files of the scenes are ([`DatasetPlan::located`]), and the guard band and second layer of all frames.
///
/// # Errors
/// As [`generate`]; also when a file is not the one that the manifest names.
pub fn remake(
    dir: &Path,
    original: &Manifest,
    work: &Work,
    on_event: &(dyn Fn(Event) + Sync),
) -> Result<Summary> {
    let given = original.frames.iter().map(|f| (f.file.as_str(), f)).collect();
    run(resume(dir, &original.plan, work.shard)?, &given, (&work.backend, on_event))
}

/// Frames whose views are known, by file.
type Given<'a> = BTreeMap<&'a str, &'a FrameEntry>;

fn run(
    mut manifest: Manifest,
    given: &Given,
    (backend, on_event): (&Backend, &(dyn Fn(Event) + Sync)),
) -> Result<Summary> {
    let jobs = manifest.plan.jobs(manifest.shard);
    let done: BTreeSet<String> = manifest.frames.iter().map(|f| f.file.clone()).collect();
    let mut summary = Summary { kept: done.len(), ..Summary::default() };
    on_event(Event::Resume { done: done.len(), total: jobs.len() });
    let missing: Vec<Job> = jobs.into_iter().filter(|&j| !done.contains(&manifest.plan.file(j))).collect();
    let mut saved = Instant::now();
    for jobs in missing.chunk_by(|a, b| a.scene == b.scene) {
        let spec = manifest.plan.scenes[jobs[0].scene].clone();
        on_event(Event::Scene(&spec.name));
        let (scene, content_triangles) = spec.load()?;
        let tracer = Tracer::new(scene);
        let stage = Stage::new(&spec, &tracer, content_triangles);
        let mut rays = backend.rays(&tracer)?;
        let folder = manifest.dir().join("frames").join(&spec.name);
        std::fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
        for &job in jobs {
            let mut entry = match given.get(manifest.plan.file(job).as_str()) {
                Some(&entry) => entry.clone(),
                None => choose(&manifest.plan, job, &stage, &mut summary)?,
            };
            entry.view = entry.view.surrounded(manifest.plan.recipe.surround);
            trace((&tracer, &mut rays), &entry, on_event)?.save(&manifest.path(&entry))?;
            summary.made += 1;
            on_event(Event::Frame(&entry));
            manifest.insert(entry);
            if saved.elapsed() > SAVE_EVERY {
                manifest.save()?;
                saved = Instant::now();
            }
        }
        manifest.save()?;
    }
    manifest.save()?;
    Ok(summary)
}

/// The manifest of an earlier run without the frames whose files are gone, or a new one.
fn resume(dir: &Path, plan: &DatasetPlan, shard: Option<Shard>) -> Result<Manifest> {
    if plan.recipe.is_imported() {
        let found = "imported frames: another program made them, and only it can make them again";
        return Err(Error::request("dataset", "scenes to make frames of", found));
    }
    let mut manifest = Manifest::new(dir, plan.clone(), shard);
    let path = dir.join(Manifest::file_name(shard));
    if !path.exists() {
        return Ok(manifest);
    }
    let found = Manifest::load(&path)?;
    found.check_same(&manifest)?;
    let planned: BTreeSet<String> = plan.jobs(shard).into_iter().map(|j| plan.file(j)).collect();
    let kept = found.frames.into_iter().filter(|f| planned.contains(&f.file) && dir.join(&f.file).is_file());
    manifest.frames = kept.collect();
    Ok(manifest)
}

fn choose(plan: &DatasetPlan, job: Job, stage: &Stage, summary: &mut Summary) -> Result<FrameEntry> {
    let (recipe, scene) = (&plan.recipe, &plan.scenes[job.scene].name);
    let mut random = Random::of_frame(recipe.seed, scene, job.index);
    // 53 bits: JSON numbers are doubles to most readers.
    let seed = random.bits() >> 11;
    let (view, flaws) = stage.view(&recipe.framing(), &mut random)?;
    flaws.into_iter().for_each(|f| *summary.flaws.entry(f).or_default() += 1);
    summary.chosen += 1;
    Ok(FrameEntry {
        file: plan.file(job),
        scene: scene.clone(),
        index: job.index,
        split: job.split,
        radius: view.radius,
        spp: recipe.spp(job.split),
        seed,
        view,
        source: None,
    })
}

fn trace(
    (tracer, rays): (&Tracer, &mut Rays<'_>),
    entry: &FrameEntry,
    on_event: &(dyn Fn(Event) + Sync),
) -> Result<Frame> {
    let view = &entry.view;
    let surface = gbuffer::render(tracer, view)?;
    let sampling = Sampling { spp: entry.spp, seed: entry.seed };
    let ao = rays.reference_ao(&surface, view.params()?, sampling, &|n| on_event(Event::Rays(n)))?;
    let (radius, view) = (Some(entry.radius), Some(view.clone()));
    Ok(Frame { gbuffer: surface.gbuffer, geo_normal: None, ao: Some(ao), radius, view })
}
