//! Methods as points over their time, and the front that no method beats in both.

use super::{COLOURS, Drawn};
use aonet_scene::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Width of the picture, and height of one chart (px).
const WIDTH: u32 = 960;
const HEIGHT: u32 = 380;
/// Size of text (px), and the mean width of a letter.
const TEXT: i32 = 13;
const LETTER: i32 = 7;
/// Width of the labels of the scores (px), and the left edge of the charts: a margin comes before the labels.
const SCORES: i32 = 56;
const LEFT: i32 = 10 + SCORES;
/// Radius of a point (px).
const RADIUS: i32 = 5;

/// One method in one chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Its name, drawn beside it.
    pub label: String,
    /// Time (ms), > 0; less is better. The axis is logarithmic.
    pub ms: f64,
    /// Score; more is better.
    pub score: f64,
    /// Colour: points of one group share it.
    pub group: usize,
}

/// One chart: its title, what the axis of times says, and its points. Points that are not finite, or take no time, are left out.
#[derive(Debug, Clone, Copy)]
pub struct Front<'a> {
    /// The score and its unit.
    pub title: &'a str,
    /// The time and its unit.
    pub axis: &'a str,
    /// The methods.
    pub points: &'a [Point],
}

/// Charts below each other, as the text of an SVG.
///
/// # Errors
/// When they cannot be drawn.
pub fn fronts(charts: &[Front<'_>]) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, charts).map_err(|e| Error::request("plot", "points that can be drawn", e))?;
    Ok(svg)
}

fn draw<'a>(svg: &'a mut String, charts: &[Front<'_>]) -> Drawn<'a> {
    let rows = charts.len().max(1);
    let root = SVGBackend::with_string(svg, (WIDTH, HEIGHT * rows as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, front) in root.split_evenly((rows, 1)).iter().zip(charts) {
        let points: Vec<&Point> = front.points.iter().filter(|p| drawable(p)).collect();
        if !points.is_empty() {
            chart(area, front, &points)?;
        }
    }
    root.present()
}

fn drawable(p: &Point) -> bool {
    p.ms.is_finite() && p.ms > 0.0 && p.score.is_finite()
}

/// Points that no other one beats: faster and at least as good, or better and at least as fast. Fastest first.
fn best<'a>(points: &[&'a Point]) -> Vec<&'a Point> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.ms.total_cmp(&b.ms).then(b.score.total_cmp(&a.score)));
    let mut reached = f64::NEG_INFINITY;
    sorted.retain(|p| {
        let better = p.score > reached;
        reached = reached.max(p.score);
        better
    });
    sorted
}

fn chart<'a>(area: &DrawingArea<SVGBackend<'a>, Shift>, front: &Front<'_>, points: &[&Point]) -> Drawn<'a> {
    let ms = super::range(points.iter().map(|p| p.ms.ln()), 0.14);
    let scores = super::range(points.iter().map(|p| p.score), 0.08);
    let mut chart = ChartBuilder::on(area)
        .caption(front.title, ("sans-serif", 18))
        .margin(LEFT - SCORES)
        .x_label_area_size(44)
        .y_label_area_size(SCORES)
        .build_cartesian_2d((ms.start.exp()..ms.end.exp()).log_scale(), scores)?;
    chart.configure_mesh().x_desc(front.axis).max_light_lines(0).x_labels(6).y_labels(6).draw()?;
    let corners = best(points).into_iter().map(|p| (p.ms, p.score));
    chart.draw_series(LineSeries::new(corners, BLACK.mix(0.35)))?;
    let places: Vec<_> = points.iter().map(|p| chart.backend_coord(&(p.ms, p.score))).collect();
    let mut taken: Vec<Box> = places.iter().map(|at| Box::around(*at)).collect();
    for (point, at) in points.iter().zip(places) {
        let colour = COLOURS[point.group % COLOURS.len()];
        let label = Box::beside(at, &point.label, &taken);
        let text = TextStyle::from(("sans-serif", TEXT)).color(&BLACK).pos(Pos::new(HPos::Left, VPos::Top));
        let shift = (label.left - at.0, label.top - at.1);
        taken.push(label);
        chart.draw_series([EmptyElement::at((point.ms, point.score))
            + Circle::new((0, 0), RADIUS, colour.filled())
            + Text::new(point.label.clone(), shift, text)])?;
    }
    Ok(())
}

/// A rectangle of the picture (px).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Box {
    left: i32,
    top: i32,
    width: i32,
    height: i32,
}

impl Box {
    fn around((x, y): (i32, i32)) -> Self {
        Self { left: x - RADIUS, top: y - RADIUS, width: 2 * RADIUS, height: 2 * RADIUS }
    }

    /// Where a label is drawn: the first of the places around its point that is free and inside the picture, else the first.
    fn beside((x, y): (i32, i32), label: &str, taken: &[Self]) -> Self {
        let (width, height) = (LETTER * label.chars().count() as i32, TEXT + 2);
        let gap = RADIUS + 3;
        let rows = [-height / 2, -height - gap, gap, -2 * height - gap, height + gap];
        let columns = [gap, -width - gap, -width / 2];
        let places = rows.iter().flat_map(|dy| columns.map(|dx| (dx, *dy)));
        let boxes: Vec<Self> =
            places.map(|(dx, dy)| Self { left: x + dx, top: y + dy, width, height }).collect();
        let free = |b: &Self| {
            b.left >= LEFT && b.left + b.width <= WIDTH as i32 && !taken.iter().any(|other| b.meets(other))
        };
        boxes.iter().copied().find(free).unwrap_or(boxes[0])
    }

    fn meets(&self, other: &Self) -> bool {
        let apart = |a: i32, length: i32, b: i32, other: i32| a + length <= b || b + other <= a;
        !apart(self.left, self.width, other.left, other.width)
            && !apart(self.top, self.height, other.top, other.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(label: &str, ms: f64, score: f64) -> Point {
        Point { label: label.into(), ms, score, group: 0 }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [
            point("slow and good", 9.0, 3.0),
            point("beaten", 4.0, 1.0),
            point("fast", 1.0, 2.0),
            point("equal but slower", 2.0, 2.0),
        ];
        let names = best(&points.each_ref()).iter().map(|p| p.label.as_str()).collect::<Vec<_>>();
        assert_eq!(names, ["fast", "slow and good"]);
    }

    #[test]
    fn labels_do_not_meet_and_odd_points_are_left_out() {
        let points: Vec<Point> =
            (0..6).map(|i| point(&format!("method {i}"), 10.0 + 0.01 * f64::from(i), 2.0)).collect();
        let at = (400, 100);
        let mut taken = vec![Box::around(at)];
        for p in &points {
            let label = Box::beside(at, &p.label, &taken);
            assert!(!taken.iter().any(|other| label.meets(other)), "{label:?} {taken:?}");
            taken.push(label);
        }
        let odd = [
            point("nan", f64::NAN, 1.0),
            point("no time", 0.0, 1.0),
            point("a <b>", 5.0, 2.0),
            point("c", 7.0, 3.0),
        ];
        let svg = fronts(&[("PSNR", &odd[..]), ("none", &[])].map(|(title, points)| Front {
            title,
            axis: "ms",
            points,
        }))
        .unwrap();
        assert!(svg.contains("a &lt;b&gt;") && !svg.contains("nan") && !svg.contains("NaN"), "{svg}");
        assert!(!svg.contains("no time"), "{svg}");
    }
}
