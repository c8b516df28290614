//! `aonet dataset`: frames for training and evaluation.

mod import;
mod make;
mod mix;
mod progress;
mod sheet;

use crate::device::Device;
use crate::names;
use crate::output;
use crate::setup::{SizeArgs, SurroundArgs};
use anyhow::Result;
use aonet_lab::dataset::{self, Manifest, Shard};
use clap::{Parser, Subcommand};
use std::path::PathBuf;

/// Frames of a contact sheet.
const FRAMES: usize = 24;

/// Frames in a row of a contact sheet.
const COLUMNS: usize = 4;

/// What frames show besides their pictures; there is no view to take it from.
const MARGIN: &str =
    "Guard band on each side, as a share of the image's width and height [default: that of --from, else 0]";
const LAYERS: &str = "Layers of depth and normals: 2 adds the nearest surface behind the visible one [default: that of --from, else 1]";

/// Options that --manifest already determines.
const NOT_WITH_FROM: [&str; 12] = [
    "preset",
    "scene",
    "environment",
    "procedural",
    "split",
    "frames",
    "size",
    "width",
    "height",
    "spp",
    "eval_spp",
    "seed",
];

/// Make frames with ray-traced AO for training and evaluation.
///
/// Can be stopped at any moment and started again: complete frames are kept. Without scenes, procedural scenes are used.
#[derive(Debug, Parser)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    mut_arg("size", |arg| arg.help("Image size (px), such as 640x360 [default: the preset's]")),
    mut_arg("margin", |arg| arg.help(MARGIN)),
    mut_arg("layers", |arg| arg.help(LAYERS)),
    after_help = "Examples:\n  aonet dataset frames --frames 200 --contact-sheet sheet.png\n  \
                  aonet dataset paper --preset paper --scenes-dir scenes --shard 1/2"
)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    make: Make,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Make a dataset of frames that another program made: folders of OpenEXR images of normals, depth and AO.
    ///
    /// A frame is three files with one name: their path below the folders without .exr. Where names differ, a last word that
    /// all files of a folder share (0001_normal, 0001_depth), else a shared first word, is ignored. The first folder
    /// of a name is its scene. Can be stopped and started again.
    Import(import::Args),
    /// Join the shards in one or more folders into the first of them.
    Merge {
        /// Folders with manifest-I-of-N.json.
        #[arg(required = true)]
        dirs: Vec<PathBuf>,
    },
    /// Make new scenes of the training scenes of a list, for --scenes-dir.
    ///
    /// Objects stand, lie and hang in other scenes, in procedural ones and in heaps, in other sizes and proportions. Scenes
    /// of validation and test are not shown.
    Mix(mix::Args),
    /// Draw many frames in one picture: normals above AO.
    Sheet(sheet::Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct Make {
    /// Folder to write frames and the manifest into.
    #[arg(required = true)]
    out_dir: Option<PathBuf>,
    /// Starting values for everything below.
    #[arg(long, value_enum, default_value = "any-radius")]
    preset: make::PresetName,
    /// Folder with scenes.csv and the glTF files that it lists.
    #[arg(long, value_name = "DIR")]
    scenes_dir: Option<PathBuf>,
    /// Make the frames of this manifest again, with the files of --scenes-dir; --margin and --layers give them more than they had.
    #[arg(long, value_name = "MANIFEST", conflicts_with_all = NOT_WITH_FROM)]
    from: Option<PathBuf>,
    /// A glTF file, as a single object on a ground plane. May be repeated.
    #[arg(long, value_name = "FILE")]
    scene: Vec<PathBuf>,
    /// A glTF file that a camera can stand inside. May be repeated.
    #[arg(long, value_name = "FILE")]
    environment: Vec<PathBuf>,
    /// Procedural scenes, such as street:0..8 or cave:3. May be repeated. Without this, --scene and
    /// --environment, the any-radius preset has four of every kind.
    #[arg(long, value_name = "KIND:SEEDS")]
    procedural: Vec<String>,
    /// The split of the scenes of --scene, --environment and --procedural.
    #[arg(long, value_enum, default_value = "train")]
    split: make::SplitName,
    /// Frames of all splits together, in the preset's proportions.
    #[arg(long)]
    frames: Option<u32>,
    #[command(flatten)]
    size: SizeArgs,
    /// Reference rays per pixel, of all splits unless --eval-spp says otherwise.
    #[arg(long)]
    spp: Option<u32>,
    /// Reference rays per pixel of validation and test frames.
    #[arg(long)]
    eval_spp: Option<u32>,
    /// AO radius as a fraction of each scene's bounding sphere, the same in all its frames.
    #[arg(long, value_name = "FRACTION")]
    scene_radius: Option<f32>,
    #[command(flatten)]
    surround: SurroundArgs,
    /// Seed of everything random.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Make part I of N, 1 <= I <= N, to be joined by `aonet dataset merge`.
    #[arg(long, value_name = "I/N", value_parser = make::parse_shard)]
    shard: Option<Shard>,
    /// Where rays are traced. Frames of different devices differ by rounding only and go together.
    #[arg(long, value_enum, default_value_t)]
    device: Device,
    /// Draw a contact sheet at the end.
    #[arg(long, value_name = "FILE.png", value_parser = names::png())]
    contact_sheet: Option<PathBuf>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When a request cannot be met or a file cannot be read or written.
pub(crate) fn run(args: Args) -> Result<()> {
    match args.action {
        None => make::run(&args.make),
        Some(Action::Import(args)) => import::run(args),
        Some(Action::Merge { dirs }) => {
            let manifest = dataset::merge(&dirs)?;
            output::text(&format!("{}\n", manifest.dir().join(Manifest::file_name(None)).display()))
        }
        Some(Action::Mix(args)) => mix::run(&args),
        Some(Action::Sheet(args)) => sheet::run(&args),
    }
}
