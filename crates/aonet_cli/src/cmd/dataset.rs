//! `aonet dataset`: frames for training and evaluation.

use crate::output;
use anyhow::{Context, Result, bail};
use aonet_offline::dataset::{
    self, Event, Manifest, Plan, Preset, RadiusRule, Recipe, SceneSpec, SceneSplit, Shard,
};
use aonet_offline::scene::procedural::Kind;
use clap::{Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Make frames with ray-traced AO for training and evaluation.
///
/// May be stopped at any moment and started again: complete frames are kept.
#[derive(Debug, Parser)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    make: Make,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Join the shards in one or more folders into the first of them.
    Merge {
        /// Folders with manifest-I-of-N.json.
        #[arg(required = true)]
        dirs: Vec<PathBuf>,
    },
    /// Draw many frames in one picture: normals above AO.
    Sheet {
        /// The dataset's folder, or a manifest.
        dataset: PathBuf,
        /// The picture to write (PNG).
        #[arg(short, long)]
        output: PathBuf,
        /// How many frames, spread over the dataset.
        #[arg(long, default_value_t = 24)]
        count: usize,
        /// Frames in a row.
        #[arg(long, default_value_t = 6)]
        columns: usize,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PresetName {
    /// As in the paper: 37 scenes, 3996 frames of 1280x720, one radius a scene.
    Paper,
    /// All scenes and procedural ones, a radius of its own for every frame.
    AnyRadius,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SplitName {
    Train,
    Val,
    Test,
}

#[derive(Debug, clap::Args)]
struct Make {
    /// Folder to write frames and the manifest into.
    #[arg(required = true)]
    out_dir: Option<PathBuf>,
    /// Starting values for everything below.
    #[arg(long, value_enum, default_value = "any-radius")]
    preset: PresetName,
    /// Folder with scenes.csv and the glTF files that it lists.
    #[arg(long, value_name = "DIR")]
    scenes_dir: Option<PathBuf>,
    /// A glTF file, as a single object on a ground plane. May be repeated.
    #[arg(long, value_name = "FILE")]
    scene: Vec<PathBuf>,
    /// A glTF file that a camera can stand inside. May be repeated.
    #[arg(long, value_name = "FILE")]
    environment: Vec<PathBuf>,
    /// Scenes made from code, such as street:0..8 or cave:3. May be repeated. Without this, --scene and
    /// --environment, the any-radius preset has four of every kind.
    #[arg(long, value_name = "KIND:SEEDS")]
    procedural: Vec<String>,
    /// What the scenes of --scene, --environment and --procedural are kept for.
    #[arg(long, value_enum, default_value = "train")]
    split: SplitName,
    /// Frames of all splits together, shared out as in the preset.
    #[arg(long)]
    frames: Option<u32>,
    /// Image width [px].
    #[arg(long)]
    width: Option<usize>,
    /// Image height [px].
    #[arg(long)]
    height: Option<usize>,
    /// Reference rays per pixel, of all splits unless --eval-spp says otherwise.
    #[arg(long)]
    spp: Option<u32>,
    /// Reference rays per pixel of validation and test frames.
    #[arg(long)]
    eval_spp: Option<u32>,
    /// AO radius as a fraction of each scene's bounding sphere, the same in all its frames.
    #[arg(long, value_name = "FRACTION")]
    scene_radius: Option<f32>,
    /// Seed of everything random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Make part I of N, 1 <= I <= N, to be joined by `aonet dataset merge`.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    shard: Option<Shard>,
    /// Draw a contact sheet at the end.
    #[arg(long, value_name = "FILE.png")]
    contact_sheet: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When a request cannot be met or a file cannot be read or written.
pub(crate) fn run(args: Args) -> Result<()> {
    match args.action {
        None => make(&args.make),
        Some(Action::Merge { dirs }) => {
            let manifest = dataset::merge(&dirs)?;
            output::text(&format!("{}\n", manifest.dir().join("manifest.json").display()))
        }
        Some(Action::Sheet { dataset, output, count, columns }) => {
            let manifest = Manifest::load(&dataset)?;
            Ok(dataset::save_png(&dataset::contact_sheet(&manifest, count, columns)?, &output)?)
        }
    }
}

fn make(make: &Make) -> Result<()> {
    let out_dir = make.out_dir.as_ref().context("OUT_DIR is missing")?;
    let plan = plan(make)?;
    let progress = Progress::new();
    let summary = dataset::generate(out_dir, &plan, make.shard, &|event| progress.on_event(event))?;
    progress.finish(&summary);
    let name = Manifest::file_name(make.shard);
    if let Some(sheet) = &make.contact_sheet {
        let manifest = Manifest::load(&out_dir.join(&name))?;
        dataset::save_png(&dataset::contact_sheet(&manifest, 24, 6)?, sheet)?;
    }
    output::text(&format!("{}\n", out_dir.join(name).display()))
}

fn plan(make: &Make) -> Result<Plan> {
    let preset = match make.preset {
        PresetName::Paper => Preset::Paper,
        PresetName::AnyRadius => Preset::AnyRadius,
    };
    let scenes = scenes(make, preset)?;
    if scenes.is_empty() {
        bail!("no scenes: give --scenes-dir, --scene, --environment or --procedural");
    }
    let mut recipe = Recipe::preset(preset);
    recipe.seed = make.seed;
    recipe.width = make.width.unwrap_or(recipe.width);
    recipe.height = make.height.unwrap_or(recipe.height);
    recipe.spp = make.spp.unwrap_or(recipe.spp);
    recipe.eval_spp = make.eval_spp.or(make.spp).unwrap_or(recipe.eval_spp);
    recipe.radius = make.scene_radius.map_or(recipe.radius, RadiusRule::SceneFraction);
    recipe.frames = recipe.frames.kept(|split| scenes.iter().any(|s| s.split.allows(split)));
    recipe.frames = make.frames.map_or(recipe.frames, |total| recipe.frames.scaled_to(total));
    Ok(Plan::new(recipe, scenes)?)
}

fn scenes(make: &Make, preset: Preset) -> Result<Vec<SceneSpec>> {
    let split = match make.split {
        SplitName::Train => SceneSplit::Train,
        SplitName::Val => SceneSplit::Val,
        SplitName::Test => SceneSplit::Test,
    };
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

fn parse_shard(text: &str) -> Result<Shard> {
    let (index, count) = text.split_once('/').context("expected I/N")?;
    Ok(Shard::new(index.parse()?, count.parse()?)?)
}

/// A bar over frames on a terminal; always the number of rays.
struct Progress {
    bar: ProgressBar,
    rays: AtomicU64,
    start: Instant,
}

impl Progress {
    fn new() -> Self {
        let style = "{msg:24} {wide_bar} {pos}/{len} frames, {prefix}, {eta} left";
        let style = ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self { bar: ProgressBar::new(0).with_style(style), rays: AtomicU64::new(0), start: Instant::now() }
    }

    fn on_event(&self, event: Event) {
        match event {
            Event::Resume { done, total } => {
                self.bar.set_length(total as u64);
                self.bar.set_position(done as u64);
                self.bar.reset_eta();
            }
            Event::Scene(name) => self.bar.set_message(name.to_owned()),
            Event::Rays(n) => {
                let rays = self.rays.fetch_add(n, Ordering::Relaxed) + n;
                self.bar.set_prefix(format!("{:.1} Mray/s", self.rate(rays)));
            }
            Event::Frame(_) => self.bar.inc(1),
        }
    }

    /// Million rays per second since the start.
    fn rate(&self, rays: u64) -> f64 {
        rays as f64 / 1e6 / self.start.elapsed().as_secs_f64().max(1e-9)
    }

    fn finish(&self, summary: &dataset::Summary) {
        self.bar.finish_and_clear();
        let rays = self.rays.load(Ordering::Relaxed);
        output::note(&format!(
            "{} frames made, {} kept, {:.1} s, {:.1} Mray/s, {:.0} % of the views accepted",
            summary.made,
            summary.kept,
            self.start.elapsed().as_secs_f64(),
            self.rate(rays),
            100.0 * summary.acceptance()
        ));
        for (flaw, count) in &summary.flaws {
            output::note(&format!("  {count} views dropped: {}", flaw.name()));
        }
    }
}
