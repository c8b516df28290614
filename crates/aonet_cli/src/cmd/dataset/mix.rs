//! `aonet dataset mix`: new scenes made of old ones.

use crate::output;
use anyhow::{Context, Result, bail};
use aonet_lab::dataset::{Preset, Stock, catalog};
use aonet_scene::atomic_file;
use indicatif::ProgressBar;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder to write mix_SEED.glb and scenes.csv into.
    out_dir: PathBuf,
    /// Folder with scenes.csv and the glTF files that it lists; mixtures show its training scenes.
    #[arg(long, value_name = "DIR")]
    scenes_dir: PathBuf,
    /// How many scenes.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    count: u64,
    /// Seed of the first scene; the next has the next.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1 << 60))]
    seed: u64,
}

const HEADER: &str = "name,environment,split";

/// Runs the command.
pub(super) fn run(args: &Args) -> Result<()> {
    let table = args.out_dir.join("scenes.csv");
    check_replaceable(&table)?;
    let stock = Stock::load(&catalog::scenes(&args.scenes_dir, Preset::AnyRadius)?)?;
    fs::create_dir_all(&args.out_dir).with_context(|| args.out_dir.display().to_string())?;
    let mut list = format!("{HEADER}\n");
    let bar = ProgressBar::new(args.count);
    for seed in args.seed..args.seed + args.count {
        let scene = stock.save(seed, &args.out_dir)?;
        writeln!(list, "{},{},train", scene.name, if scene.environment { "yes" } else { "no" })?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    atomic_file::write(&table, list.as_bytes())?;
    output::text(&format!("{}\n", table.display()))
}

/// A list of other scenes is not replaced.
fn check_replaceable(table: &Path) -> Result<()> {
    if !table.exists() {
        return Ok(());
    }
    let list = fs::read(table).with_context(|| table.display().to_string())?;
    let list = String::from_utf8_lossy(&list);
    let mut lines = list.lines();
    if lines.next() != Some(HEADER) || !lines.all(|line| line.starts_with("mix_")) {
        bail!("{}: expected no file, or a list of mixtures, found a list of other scenes", table.display());
    }
    Ok(())
}
