//! Curves over training steps, bars, and scores over time, as SVG.

mod bars;
mod front;

pub use bars::{Bars, bars};
pub use front::{Front, Point, fronts};

use aonet_scene::{Error, Result, atomic_file};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Width and height (px) of one chart.
const SIZE: (u32, u32) = (900, 340);

/// Colours that colour-blind readers can distinguish. // Okabe and Ito 2008
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// One curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub label: &'a str,
    /// (x, y); points that are not finite are left out.
    pub points: &'a [(f64, f64)],
}

/// Draws all `series` over one pair of axes.
///
/// # Errors
/// When the file cannot be written.
pub fn curves(path: &Path, title: &str, series: &[Series<'_>]) -> Result<()> {
    save(path, &[(title, series)])
}

/// Training loss and validation loss above validation PSNR (dB), over steps.
///
/// # Errors
/// When the file cannot be written.
pub fn training_curves(
    path: &Path,
    loss: &[(f64, f64)],
    val_loss: &[(f64, f64)],
    val_psnr: &[(f64, f64)],
) -> Result<()> {
    let losses =
        [Series { label: "training", points: loss }, Series { label: "validation", points: val_loss }];
    let psnr = [Series { label: "validation", points: val_psnr }];
    save(path, &[("loss", &losses), ("PSNR [dB]", &psnr)])
}

fn save(path: &Path, charts: &[(&str, &[Series<'_>])]) -> Result<()> {
    let mut svg = String::new();
    draw(&mut svg, charts).map_err(|e| Error::file(path, "curves that can be drawn", e))?;
    atomic_file::write(path, svg.as_bytes())
}

type Drawn<'a> = std::result::Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(svg: &'a mut String, charts: &[(&str, &[Series<'_>])]) -> Drawn<'a> {
    let root = SVGBackend::with_string(svg, (SIZE.0, SIZE.1 * charts.len() as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, (title, series)) in root.split_evenly((charts.len(), 1)).iter().zip(charts) {
        chart(area, title, series)?;
    }
    root.present()
}

fn chart<'a>(area: &DrawingArea<SVGBackend<'a>, Shift>, title: &str, series: &[Series<'_>]) -> Drawn<'a> {
    let finite = |s: &Series<'_>| -> Vec<(f64, f64)> {
        s.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
    };
    let all: Vec<(f64, f64)> = series.iter().flat_map(finite).collect();
    let (xs, ys) = (range(all.iter().map(|p| p.0), 0.0), range(all.iter().map(|p| p.1), 0.05));
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(28)
        .y_label_area_size(56)
        .build_cartesian_2d(xs, ys)?;
    chart.configure_mesh().light_line_style(BLACK.mix(0.04)).draw()?;
    for (s, colour) in series.iter().zip(COLOURS.iter().cycle()) {
        let style = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(finite(s), style))?
            .label(s.label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.2)).draw()
}

/// The range of `values` with a `margin` (a share of it) on both sides; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    match low < high {
        true => low - margin * (high - low)..high + margin * (high - low),
        false if low == high => low - 0.5..high + 0.5,
        false => 0.0..1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_hold_their_labels_and_survive_odd_points() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("c.svg");
        let odd = [(0.0, f64::NAN), (1.0, 2.0), (2.0, f64::INFINITY), (3.0, 1.0)];
        training_curves(&path, &odd, &[], &[(5.0, 30.0)]).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("training") && svg.contains("PSNR") && !svg.contains("NaN"), "{svg}");
        curves(&path, "only", &[Series { label: "a & b", points: &odd }]).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        assert!(svg.contains("only") && svg.contains("a &amp; b"), "{svg}");
        curves(&path, "nothing", &[]).unwrap();
        assert!(curves(dir.path(), "a folder", &[]).is_err());
    }
}
