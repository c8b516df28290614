//! Bars side by side, in groups, with their values above them.

use super::{COLOURS, Drawn};
use aonet_scene::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Width of the picture, and height of one chart (px).
const WIDTH: u32 = 960;
const HEIGHT: u32 = 250;

/// Space for title and legend above the bars, for group names below, and at both sides (px).
const ABOVE: i32 = 62;
const BELOW: i32 = 26;
const SIDE: i32 = 12;

/// Share of a group's width that its bars take.
const FILLED: f64 = 0.78;

/// Sizes of text (px), and the mean width of a small letter of a sans-serif font.
const TITLE: i32 = 16;
const SMALL: i32 = 12;
const LETTER: i32 = 7;

/// One chart.
#[derive(Debug, Clone, Copy)]
pub struct Bars<'a> {
    /// Its title.
    pub title: &'a str,
    /// Names below the groups, from left to right.
    pub groups: &'a [String],
    /// Name, and one value per group; missing values and values that are not finite have no bar.
    pub series: &'a [(String, Vec<Option<f64>>)],
    /// The value of a bar of full height; the chart's largest if absent.
    pub full: Option<f64>,
    /// Format of the value above a bar.
    pub label: fn(f64) -> String,
}

/// Charts in rows of `columns`, as the text of an SVG.
///
/// # Errors
/// When they cannot be drawn.
pub fn bars(charts: &[Bars<'_>], columns: usize) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, charts, columns.max(1))
        .map_err(|e| Error::request("bars", "a chart that can be drawn", e))?;
    Ok(svg)
}

fn draw<'a>(svg: &'a mut String, charts: &[Bars<'_>], columns: usize) -> Drawn<'a> {
    let rows = charts.len().div_ceil(columns).max(1);
    let root = SVGBackend::with_string(svg, (WIDTH, HEIGHT * rows as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, bars) in root.split_evenly((rows, columns)).iter().zip(charts) {
        chart(area, bars)?;
    }
    root.present()
}

fn chart<'a>(area: &DrawingArea<SVGBackend<'a>, Shift>, bars: &Bars<'_>) -> Drawn<'a> {
    let (width, height) = area.dim_in_pixel();
    let (width, base) = (width as i32, height as i32 - BELOW);
    let title = style(TITLE, HPos::Left);
    area.draw(&Text::new(bars.title.to_owned(), (SIDE, 8), title))?;
    if bars.series.len() > 1 {
        legend(area, bars)?;
    }
    let finite =
        bars.series.iter().flat_map(|(_, values)| values).flatten().copied().filter(|v| v.is_finite());
    let full = bars.full.unwrap_or_else(|| finite.fold(0.0, f64::max)).max(f64::MIN_POSITIVE);
    let scale = f64::from(base - ABOVE) / full;
    let group = f64::from(width - 2 * SIDE) / bars.groups.len().max(1) as f64;
    let bar = group * FILLED / bars.series.len().max(1) as f64;
    for (g, name) in bars.groups.iter().enumerate() {
        let left = f64::from(SIDE) + group * g as f64;
        let middle = (left + 0.5 * group) as i32;
        area.draw(&Text::new(name.clone(), (middle, base + 6), style(SMALL, HPos::Center)))?;
        for (s, (_, values)) in bars.series.iter().enumerate() {
            let Some(value) = values.get(g).copied().flatten().filter(|v| v.is_finite()) else { continue };
            let x = left + 0.5 * (1.0 - FILLED) * group + bar * s as f64;
            let top = base - (value.max(0.0) * scale).round() as i32;
            let corners = [((x + 0.5) as i32, top), ((x + bar - 0.5) as i32, base)];
            area.draw(&Rectangle::new(corners, COLOURS[s % COLOURS.len()].filled()))?;
            let at = ((x + 0.5 * bar) as i32, top - SMALL - 4);
            area.draw(&Text::new((bars.label)(value), at, style(SMALL, HPos::Center)))?;
        }
    }
    area.draw(&PathElement::new([(SIDE, base), (width - SIDE, base)], BLACK.mix(0.5)))
}

fn legend<'a>(area: &DrawingArea<SVGBackend<'a>, Shift>, bars: &Bars<'_>) -> Drawn<'a> {
    let mut left = SIDE;
    for ((label, _), colour) in bars.series.iter().zip(COLOURS.iter().cycle()) {
        area.draw(&Rectangle::new([(left, 31), (left + SMALL, 31 + SMALL)], colour.filled()))?;
        area.draw(&Text::new(label.clone(), (left + SMALL + 5, 30), style(SMALL, HPos::Left)))?;
        left += SMALL + 20 + LETTER * label.chars().count() as i32;
    }
    Ok(())
}

fn style(size: i32, across: HPos) -> TextStyle<'static> {
    TextStyle::from(("sans-serif", size)).color(&BLACK).pos(Pos::new(across, VPos::Top))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangles(svg: &str) -> Vec<[f64; 4]> {
        let value = |line: &str, key: &str| -> f64 {
            line.split_once(&format!(" {key}=\"")).unwrap().1.split('"').next().unwrap().parse().unwrap()
        };
        let lines = svg.lines().filter(|l| l.starts_with("<rect"));
        lines.map(|l| ["x", "y", "width", "height"].map(|key| value(l, key))).collect()
    }

    #[test]
    fn heights_are_in_proportion_and_stay_inside() {
        let groups = ["a <b>".to_owned(), "c".to_owned()];
        let series = [
            ("one".to_owned(), vec![Some(50.0), Some(100.0)]),
            ("two".to_owned(), vec![None, Some(f64::NAN)]),
        ];
        let chart =
            Bars { title: "t", groups: &groups, series: &series, full: None, label: |v| format!("{v:.0}%") };
        let svg = bars(&[chart, chart, chart], 2).unwrap();
        assert!(svg.contains("a &lt;b&gt;") && svg.contains("100%") && !svg.contains("NaN"), "{svg}");
        // Background; then of each chart two squares of its legend and two bars.
        let all = rectangles(&svg);
        assert_eq!(all.len(), 1 + 3 * 4);
        for chart in all[1..].chunks_exact(4) {
            let (half, whole) = (chart[2], chart[3]);
            assert!((half[3] * 2.0 - whole[3]).abs() <= 1.0, "{chart:?}");
            assert!(whole[3] > 100.0 && half[0] + half[2] < whole[0], "{chart:?}");
        }
        assert!(all.iter().all(|[x, y, w, h]| x + w <= 960.0 && y + h <= 500.0), "{all:?}");
        let half = Bars { full: Some(200.0), ..chart };
        let heights = |chart: Bars<'_>| rectangles(&bars(&[chart], 1).unwrap())[4][3];
        assert!((heights(half) * 2.0 - heights(chart)).abs() <= 1.0);
        assert!(bars(&[], 2).unwrap().starts_with("<svg"));
    }
}
