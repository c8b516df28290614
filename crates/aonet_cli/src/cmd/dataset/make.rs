//! Makes a plan from the arguments, and frames from the plan.

use super::progress::Progress;
use super::{COLUMNS, FRAMES, Make};
use crate::output;
use anyhow::{Context, Result, bail};
use aonet_lab::dataset::{self, DatasetParams, DatasetPlan, Event, Manifest, Preset, Shard, Work};
use aonet_lab::picture;
use aonet_scene::scene::procedural::Kind;
use aonet_scene::staging::{RadiusRule, SceneSpec, SceneSplit};
use clap::ValueEnum;
use serde_json::{Map, json};
use std::ops::Range;
use std::path::Path;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum PresetName {
    /// As in the paper: 37 scenes, 3996 frames of 1280x720, one radius a scene.
    Paper,
    /// All scenes, procedural ones included, and a separate radius for every frame.
    AnyRadius,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum SplitName {
    Train,
    Val,
    Test,
}

impl From<SplitName> for SceneSplit {
    fn from(name: SplitName) -> Self {
        match name {
            SplitName::Train => Self::Train,
            SplitName::Val => Self::Val,
            SplitName::Test => Self::Test,
        }
    }
}

/// Makes the dataset.
pub(super) fn run(make: &Make) -> Result<()> {
    let out_dir = make.out_dir.as_ref().context("OUT_DIR is missing")?;
    let work = Work { shard: make.shard, backend: make.device.backend()? };
    let progress = Progress::new();
    let on_event = |event: Event| progress.on_event(event);
    let summary = match &make.from {
        None => dataset::generate(out_dir, &plan(make)?, &work, &on_event)?,
        Some(manifest) => {
            let mut original = Manifest::load(manifest)?;
            let scenes_dir = make.scenes_dir.as_deref().unwrap_or(Path::new(""));
            original.plan = original.plan.located(scenes_dir);
            original.plan.recipe.surround = make.surround.or(original.plan.recipe.surround)?;
            dataset::remake(out_dir, &original, &work, &on_event)?
        }
    };
    progress.finish(&summary);
    let name = Manifest::file_name(make.shard);
    if let Some(sheet) = &make.contact_sheet {
        let manifest = Manifest::load(&out_dir.join(&name))?;
        picture::save_png(&dataset::contact_sheet(&manifest, FRAMES, COLUMNS)?, sheet)?;
    }
    let manifest = out_dir.join(name);
    if make.json {
        let (seconds, rays) = progress.cost();
        let dropped: Map<_, _> = summary.flaws.iter().map(|(f, n)| (f.name().to_owned(), json!(n))).collect();
        return output::json(&json!({
            "manifest": manifest, "made": summary.made, "kept": summary.kept, "rays": rays, "seconds": seconds,
            "views_accepted": summary.acceptance(), "views_dropped": dropped,
        }));
    }
    output::text(&format!("{}\n", manifest.display()))
}

fn plan(make: &Make) -> Result<DatasetPlan> {
    let preset = match make.preset {
        PresetName::Paper => Preset::Paper,
        PresetName::AnyRadius => Preset::AnyRadius,
    };
    let scenes = scenes(make, preset)?;
    if scenes.is_empty() {
        bail!("no scenes: give --scenes-dir, --scene, --environment or --procedural");
    }
    let mut recipe = DatasetParams::preset(preset);
    recipe.seed = make.seed;
    [recipe.width, recipe.height] = make.size.or([recipe.width, recipe.height]);
    recipe.spp = make.spp.unwrap_or(recipe.spp);
    recipe.eval_spp = make.eval_spp.or(make.spp).unwrap_or(recipe.eval_spp);
    recipe.radius = make.scene_radius.map_or(recipe.radius, RadiusRule::SceneFraction);
    recipe.surround = make.surround.or(recipe.surround)?;
    recipe.frames = recipe.frames.kept(|split| scenes.iter().any(|s| split.takes(s.split)));
    recipe.frames = make.frames.map_or(recipe.frames, |total| recipe.frames.scaled_to(total));
    Ok(DatasetPlan::new(recipe, scenes)?)
}

fn scenes(make: &Make, preset: Preset) -> Result<Vec<SceneSpec>> {
    let split = make.split.into();
    let mut scenes = match &make.scenes_dir {
        Some(dir) => dataset::catalog::scenes(dir, preset)?,
        None => Vec::new(),
    };
    for (files, environment) in [(&make.scene, false), (&make.environment, true)] {
        for file in files {
            scenes.push(SceneSpec::from_file(file, split)?.with_environment(environment));
        }
    }
    let mut procedural =
        make.procedural.iter().map(|text| parse_procedural(text)).collect::<Result<Vec<_>>>()?;
    let given = !(procedural.is_empty() && make.scene.is_empty() && make.environment.is_empty());
    if preset == Preset::AnyRadius && !given {
        procedural.extend(Kind::ALL.iter().map(|&kind| (kind, 0..4)));
    }
    for (kind, seeds) in procedural {
        for seed in seeds {
            scenes.push(SceneSpec::procedural(kind, seed, split));
        }
    }
    Ok(scenes)
}

/// `KIND:3`, `KIND:0..8` or `KIND` for seed 0.
fn parse_procedural(text: &str) -> Result<(Kind, Range<u64>)> {
    let (kind, seeds) = text.split_once(':').unwrap_or((text, "0"));
    let number = |s: &str| s.parse::<u64>().with_context(|| format!("seeds of --procedural {text}: {s:?}"));
    let seeds = match seeds.split_once("..") {
        Some((from, to)) => number(from)?..number(to)?,
        None => number(seeds)?..number(seeds)?.saturating_add(1),
    };
    if seeds.is_empty() || seeds.end - seeds.start > 10_000 {
        bail!("seeds of --procedural {text}: expected 1 to 10000 seeds, found {seeds:?}");
    }
    Ok((kind.parse()?, seeds))
}

/// `I/N`.
pub(super) fn parse_shard(text: &str) -> Result<Shard> {
    let (index, count) = text.split_once('/').context("expected I/N")?;
    Ok(Shard::new(index.parse()?, count.parse()?)?)
}
