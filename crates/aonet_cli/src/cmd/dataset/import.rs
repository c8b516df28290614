//! `aonet dataset import`: frames that another program made.

use super::make::SplitName;
use crate::output;
use anyhow::Result;
use aonet_lab::dataset::{self, Event, Import, ImportRule, Manifest, NormalCoding, Unmatched};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder to write frames and the manifest into.
    out_dir: PathBuf,
    /// Folder of normals in view space: +X right, +Y up, +Z towards the camera.
    #[arg(long, value_name = "DIR")]
    normal: PathBuf,
    /// Folder of distances along the viewing axis (world units); their sign is ignored.
    #[arg(long, value_name = "DIR")]
    depth: PathBuf,
    /// Folder of ambient occlusion: 1 open, 0 closed.
    #[arg(long, value_name = "DIR")]
    ao: PathBuf,
    /// Vertical field of view of all frames (degrees).
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    fov_y: f32,
    /// AO radius of all frames (world units).
    #[arg(long, allow_negative_numbers = true)]
    radius: f32,
    /// The split of all frames.
    #[arg(long, value_enum, default_value = "test")]
    split: SplitName,
    /// How normals are stored.
    #[arg(long, value_enum, default_value = "encoded")]
    normals: CodingName,
    /// Leave out files whose name is not in all three folders.
    #[arg(long)]
    skip_unmatched: bool,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum CodingName {
    /// As colours, n/2 + 1/2.
    Encoded,
    /// As vectors.
    Plain,
}

/// Runs the command.
pub(super) fn run(args: Args) -> Result<()> {
    let normals = match args.normals {
        CodingName::Encoded => NormalCoding::Encoded,
        CodingName::Plain => NormalCoding::Plain,
    };
    let wanted = Import {
        normal: args.normal,
        depth: args.depth,
        ao: args.ao,
        rule: ImportRule { fov_y_deg: args.fov_y, normals },
        radius: args.radius,
        split: args.split.into(),
        unmatched: if args.skip_unmatched { Unmatched::Skip } else { Unmatched::Refuse },
    };
    let (start, bar) = (Instant::now(), bar());
    let summary = dataset::import(&args.out_dir, &wanted, &|event| match event {
        Event::Resume { done, total } => {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
            bar.reset_eta();
        }
        Event::Frame(_) => bar.inc(1),
        Event::Scene(_) | Event::Rays(_) => {}
    })?;
    bar.finish_and_clear();
    let (seconds, manifest) = (start.elapsed().as_secs_f64(), args.out_dir.join(Manifest::file_name(None)));
    if args.json {
        return output::json(&json!({
            "manifest": manifest, "imported": summary.made, "kept": summary.kept,
            "files_skipped": summary.skipped, "seconds": seconds,
        }));
    }
    output::note(&format!(
        "{} frames imported, {} kept, {} files without partners left out, {seconds:.1} s",
        summary.made, summary.kept, summary.skipped
    ));
    output::text(&format!("{}\n", manifest.display()))
}

/// A bar over frames, shown on a terminal only.
fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("importing {wide_bar} {pos}/{len} frames, {eta} left");
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
