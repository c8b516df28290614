//! Making the frames of a plan: resumable, in shards, one scene in memory at a time.

use super::judge::Flaw;
use super::manifest::{FrameEntry, Manifest};
use super::plan::{Job, Plan, Shard};
use super::random::Random;
use super::sample::Stage;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::reference::{Sampling, reference_ao};
use crate::trace::Tracer;
use crate::{View, gbuffer};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

/// Between two writes of a manifest; a kill loses the record of at most this much work.
const SAVE_EVERY: Duration = Duration::from_secs(5);

/// What happens while frames are made.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// How many frames there already were, and how many there will be.
    Resume {
        /// Complete from an earlier run.
        done: usize,
        /// Of the plan, or of the shard.
        total: usize,
    },
    /// The scene of the next frames.
    Scene(&'a str),
    /// This many more reference rays were traced.
    Rays(u64),
    /// A frame is complete.
    Frame(&'a FrameEntry),
}

/// What a run did.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Frames made.
    pub made: usize,
    /// Frames kept from an earlier run.
    pub kept: usize,
    /// How often each flaw made a proposed view be dropped.
    pub flaws: BTreeMap<Flaw, usize>,
}

impl Summary {
    /// Share of the proposed views that became frames; 1 when none were proposed.
    pub fn acceptance(&self) -> f32 {
        let dropped: usize = self.flaws.values().sum();
        if self.made == 0 { 1.0 } else { self.made as f32 / (self.made + dropped) as f32 }
    }
}

/// Makes the frames of a plan, or of a shard of it, that `dir` does not hold yet, and its manifest.
///
/// It may be killed at any moment and run again: complete frames are kept, others are made anew. Equal
/// plans give equal bytes, whatever the shards, interruptions and number of threads.
///
/// # Errors
/// When `dir` holds frames of another plan, a scene cannot be read or shows nothing worth keeping, or a
/// file cannot be written.
pub fn generate(
    dir: &Path,
    plan: &Plan,
    shard: Option<Shard>,
    on_event: &(dyn Fn(Event) + Sync),
) -> Result<Summary> {
    let mut manifest = resume(dir, plan, shard)?;
    let jobs = plan.jobs(shard);
    let done: BTreeSet<String> = manifest.frames.iter().map(|f| f.file.clone()).collect();
    let mut summary = Summary { kept: done.len(), ..Summary::default() };
    on_event(Event::Resume { done: done.len(), total: jobs.len() });
    let missing: Vec<Job> = jobs.into_iter().filter(|&j| !done.contains(&plan.file(j))).collect();
    for of_scene in missing.chunk_by(|a, b| a.scene == b.scene) {
        let made = scene_frames(&mut manifest, of_scene, &mut summary, on_event);
        manifest.save()?;
        made?;
    }
    manifest.save()?;
    Ok(summary)
}

/// The manifest of an earlier run without the frames whose files are gone, or a new one.
fn resume(dir: &Path, plan: &Plan, shard: Option<Shard>) -> Result<Manifest> {
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

fn scene_frames(
    manifest: &mut Manifest,
    jobs: &[Job],
    summary: &mut Summary,
    on_event: &(dyn Fn(Event) + Sync),
) -> Result<()> {
    let spec = manifest.plan.scenes[jobs[0].scene].clone();
    on_event(Event::Scene(&spec.name));
    let (scene, content_triangles) = spec.load()?;
    let tracer = Tracer::new(scene);
    let stage = Stage::new(&spec, &tracer, content_triangles);
    let folder = manifest.dir().join("frames").join(&spec.name);
    std::fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
    let mut saved = Instant::now();
    for &job in jobs {
        let recipe = &manifest.plan.recipe;
        let mut random = Random::of_frame(recipe.seed, &spec.name, job.index);
        // 53 bits: JSON numbers are doubles to most readers.
        let seed = random.next() >> 11;
        let (view, flaws) = stage.view(recipe, &mut random)?;
        let entry = FrameEntry {
            file: manifest.plan.file(job),
            scene: spec.name.clone(),
            index: job.index,
            split: job.split,
            radius: view.radius,
            spp: recipe.spp(job.split),
            seed,
            view,
        };
        let frame = trace(&tracer, &entry, on_event)?;
        frame.save(&manifest.path(&entry))?;
        flaws.into_iter().for_each(|f| *summary.flaws.entry(f).or_default() += 1);
        summary.made += 1;
        on_event(Event::Frame(&entry));
        manifest.insert(entry);
        if saved.elapsed() > SAVE_EVERY {
            manifest.save()?;
            saved = Instant::now();
        }
    }
    Ok(())
}

fn trace(tracer: &Tracer, entry: &FrameEntry, on_event: &(dyn Fn(Event) + Sync)) -> Result<Frame> {
    let view: &View = &entry.view;
    let surface = gbuffer::render(tracer, view)?;
    let sampling = Sampling { spp: entry.spp, seed: entry.seed };
    let rays = |n| on_event(Event::Rays(n));
    let ao = reference_ao(tracer, &surface, view.params()?, sampling, &rays)?;
    Ok(Frame {
        gbuffer: surface.gbuffer,
        geo_normal: Some(surface.geo_normal),
        ao: Some(ao),
        radius: Some(entry.radius),
        view: Some(view.clone()),
    })
}
