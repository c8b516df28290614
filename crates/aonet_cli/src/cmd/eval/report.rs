//! Tables of scores as text, Markdown or JSON.

use super::Args;
use crate::output::{Style, number, table};
use crate::setup;
use anyhow::Result;
use aonet_lab::dataset::Manifest;
use aonet_lab::eval::phenomena::{self, Breakdown, Phenomenon, RadiusClass};
use aonet_lab::eval::{Row, Table};
use aonet_lab::plot::{Front, Point, fronts};
use serde::Serialize;
use serde_json::json;

/// What the numbers depend on besides the methods.
#[derive(Debug, Serialize)]
pub(super) struct Conditions {
    command: String,
    version: &'static str,
    frames: usize,
    width: usize,
    height: usize,
    /// None if imported frames do not record it.
    reference_spp: Option<u32>,
    threads: usize,
    cores: usize,
}

pub(super) fn conditions(args: &Args, manifest: &Manifest, threads: usize) -> Conditions {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (split, recipe) = (args.split.into(), &manifest.plan.recipe);
    Conditions {
        command: format!("aonet {}", words.join(" ")),
        version: env!("CARGO_PKG_VERSION"),
        frames: manifest.frames(split).count(),
        width: recipe.width,
        height: recipe.height,
        reference_spp: Some(recipe.spp(split)).filter(|spp| *spp > 0),
        threads,
        cores: setup::threads(None),
    }
}

pub(super) fn as_text(args: &Args, table: &Table, c: &Conditions) -> String {
    let style = if args.markdown { Style::Markdown } else { Style::Text };
    let mut text = draw(&table.overall, style);
    if table.overall.iter().any(|(name, _)| name.ends_with(" *")) {
        text += "\n* trained for another choice of radius\n";
    }
    if args.breakdown {
        text += &format!(
            "\nRMSE / mean error (above zero: too bright) by place and by radius; grain of smooth surfaces beside the reference's\n\n{}",
            breakdown(table, style)
        );
    }
    if args.by_scene {
        for (scene, rows) in &table.by_scene {
            text += &format!("\n{}{scene}\n\n{}", if args.markdown { "### " } else { "" }, draw(rows, style));
        }
    }
    let quote = if args.markdown { "`" } else { "" };
    let reference = c.reference_spp.map_or_else(|| "imported".into(), |spp| format!("{spp} rays"));
    text + &format!(
        "\n{} frames of {}x{}, reference {}; {} threads on {} cores; aonet {}\n{quote}{}{quote}\n",
        c.frames, c.width, c.height, reference, c.threads, c.cores, c.version, c.command
    )
}

fn draw(rows: &[(String, Row)], style: Style) -> String {
    let cells = |(name, row): &(String, Row)| {
        vec![
            name.clone(),
            number(row.ssim, 4),
            number(row.ssim_8x8, 4),
            number(row.psnr, 2),
            number(row.psnr_pooled, 2),
            number(row.ssim_foreground, 4),
            number(row.psnr_foreground, 2),
            number(row.ms, 1),
        ]
    };
    let header = ["method", "SSIM", "SSIM 8x8", "PSNR dB", "pooled dB", "SSIM fg", "PSNR fg", "ms"];
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>(), style)
}

fn breakdown(results: &Table, style: Style) -> String {
    let mut header = vec!["method"];
    header.extend(Phenomenon::ALL.iter().map(|p| p.name()));
    header.extend(RadiusClass::ALL.iter().map(|c| c.name()));
    header.push("grain");
    let cells = |(name, b): &(String, Breakdown)| {
        let errors = b.phenomena.iter().chain(&b.radii);
        let cell = |e: &phenomena::PixelError| format!("{} / {}", number(e.rmse(), 3), number(e.bias(), 3));
        let grain = number(b.grain.ratio(), 2);
        std::iter::once(name.clone()).chain(errors.map(cell)).chain([grain]).collect()
    };
    table(&header, &results.breakdown.iter().map(cells).collect::<Vec<_>>(), style)
}

/// PSNR and SSIM over the time of each row (ms), which the axis names: one colour for the networks, which are the first rows after the
/// constant, and one for the rest.
pub(super) fn as_plot(table: &Table, networks: usize, (axis, ms): (&str, &[Option<f64>])) -> Result<String> {
    let points = |score: fn(&Row) -> f64| -> Vec<Point> {
        let timed = table.overall.iter().zip(ms).enumerate().filter_map(|(i, ((name, row), ms))| {
            ms.map(|ms| Point {
                label: name.clone(),
                ms,
                score: score(row),
                group: usize::from(i > networks),
            })
        });
        timed.collect()
    };
    let (psnr, ssim) = (points(|row| row.psnr), points(|row| row.ssim));
    let of = |title, points| Front { title, axis, points };
    Ok(fronts(&[of("PSNR (dB)", &psnr), of("SSIM", &ssim)])?)
}

pub(super) fn as_json(args: &Args, table: &Table, conditions: &Conditions) -> Result<String> {
    let rows = |rows: &[(String, Row)]| -> Vec<_> {
        rows.iter().map(|(name, row)| json!({ "method": name, "scores": row })).collect()
    };
    let scenes: serde_json::Map<_, _> =
        table.by_scene.iter().map(|(s, r)| (s.clone(), json!(rows(r)))).collect();
    let document = json!({
        "dataset": args.dataset, "conditions": conditions, "overall": rows(&table.overall), "by_scene": scenes,
        "breakdown": table.breakdown.iter().map(|(n, b)| json!({ "method": n, "errors": b })).collect::<Vec<_>>(),
    });
    Ok(format!("{}\n", serde_json::to_string_pretty(&document)?))
}
