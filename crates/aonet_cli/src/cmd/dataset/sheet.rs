//! `aonet dataset sheet`: a dataset at a glance.

use super::{COLUMNS, FRAMES};
use crate::names;
use anyhow::Result;
use aonet_lab::dataset::{self, Manifest};
use aonet_lab::picture;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The dataset's folder, or a manifest.
    dataset: PathBuf,
    /// PNG to write.
    #[arg(short, long, value_name = "FILE.png", value_parser = names::png())]
    output: PathBuf,
    /// How many frames, spread over the dataset.
    #[arg(long, default_value_t = FRAMES)]
    count: usize,
    /// Frames in a row.
    #[arg(long, default_value_t = COLUMNS)]
    columns: usize,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> Result<()> {
    let sheet = dataset::contact_sheet(&Manifest::load(&args.dataset)?, args.count, args.columns)?;
    Ok(picture::save_png(&sheet, &args.output)?)
}
