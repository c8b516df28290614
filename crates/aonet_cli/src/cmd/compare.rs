//! `aonet compare`: SSIM and PSNR of AO images against a reference.

use crate::names;
use crate::output::{self, Style, number, table};
use crate::{Outcome, setup};
use anyhow::{Context, Result, ensure};
use aonet::AoImage;
use aonet::metrics::{self, Comparison};
use aonet_lab::ao_file::load_ao;
use aonet_lab::frame::{Frame, FrameHints};
use aonet_lab::picture::{self, Caption};
use clap::Parser;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Compare AO images with a reference: SSIM and PSNR, over the full frame and over the foreground.
///
/// The foreground is known where the reference is a frame with depth.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet compare frame.exr ao.exr --picture compare.png
  aonet compare reference.png a.png b.png --min-ssim 0.9   (exit status 1 if one is below)")]
pub(crate) struct Args {
    /// Reference: a frame with the channel `ao`, or an AO image (.exr, .png).
    reference: PathBuf,
    /// AO images of the same size.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// Fail if an image's SSIM over the full frame is lower.
    #[arg(long, value_parser = number_that_compares)]
    min_ssim: Option<f64>,
    /// Fail if an image's PSNR over the full frame is lower (dB).
    #[arg(long, value_parser = number_that_compares)]
    min_psnr: Option<f64>,
    /// Draw reference, images and their errors side by side.
    #[arg(long, value_name = "FILE.png", value_parser = names::png())]
    picture: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<Outcome> {
    let (reference, foreground) = reference(&args.reference)?;
    let mut rows = Vec::new();
    for path in &args.images {
        let image = load_ao(path)?;
        let comparison = metrics::compare(&reference, &image, foreground.as_deref())
            .with_context(|| format!("{} against {}", path.display(), args.reference.display()))?;
        rows.push((path, image, comparison));
    }
    if let Some(path) = &args.picture {
        draw(path, &reference, &rows)?;
    }
    if args.json {
        let images = rows
            .iter()
            .map(|(path, _, c)| json!({ "image": path, "full": c.full, "foreground": c.foreground }));
        output::json(&json!({ "reference": args.reference, "images": images.collect::<Vec<_>>() }))?;
    } else {
        let cells = rows.iter().map(|(path, _, c)| cells(path, c)).collect::<Vec<_>>();
        let header = ["image", "SSIM", "SSIM 8x8", "PSNR dB", "SSIM fg", "PSNR dB fg"];
        output::text(&table(&header, &cells, Style::Text))?;
    }
    let fails = |c: &Comparison| {
        args.min_ssim.is_some_and(|least| c.full.ssim < least)
            || args.min_psnr.is_some_and(|least| c.full.psnr < least)
    };
    Ok(if rows.iter().any(|(_, _, c)| fails(c)) { Outcome::CheckFailed } else { Outcome::Done })
}

/// Refuses NaN: a check against it could never fail.
fn number_that_compares(text: &str) -> Result<f64> {
    let value: f64 = text.parse()?;
    ensure!(!value.is_nan(), "expected a number");
    Ok(value)
}

fn cells(path: &Path, c: &Comparison) -> Vec<String> {
    let inside = c.foreground.as_ref();
    vec![
        path.display().to_string(),
        number(c.full.ssim, 4),
        number(c.full.ssim_8x8, 4),
        number(c.full.psnr, 2),
        number(inside.map(|f| f.ssim), 4),
        number(inside.map(|f| f.psnr), 2),
    ]
}

/// AO of a frame with its foreground, or of an image without.
fn reference(path: &Path) -> Result<(AoImage, Option<Vec<bool>>)> {
    let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    // Any camera serves: only AO and the foreground, by depth, are read.
    let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
    if is_exr && let Ok(Frame { gbuffer, ao: Some(ao), .. }) = Frame::load(path, &hints) {
        return Ok((ao, Some(gbuffer.foreground())));
    }
    Ok((load_ao(path)?, None))
}

fn draw(path: &Path, reference: &AoImage, rows: &[(&PathBuf, AoImage, Comparison)]) -> Result<()> {
    let mut panels = vec![(picture::ao(reference), Caption::new("reference"))];
    for (name, image, c) in rows {
        let scores = format!("SSIM {:.4}  PSNR {:.2} dB", c.full.ssim, c.full.psnr);
        panels.push((picture::ao(image), Caption::new(setup::name_of(name))));
        let caption = Caption { text: scores, error_legend: true };
        panels.push((picture::error(reference, image)?, caption));
    }
    let columns = panels.len().min(3);
    Ok(picture::save_png(&picture::sheet(&panels, columns)?, path)?)
}
