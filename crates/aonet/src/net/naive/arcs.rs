//! Connected arcs of a frame, pixel by pixel in f64: what becomes of a pixel's light.
//!
//! A side of a slice has 32 sectors of equal light between the viewer and the tangent plane. Two taps on one surface block the
//! sectors between them. Light that passes behind a tap of the last layer is hidden, and light that leaves the frame is off. For bent
//! normals a side has eight parts; what is lost in a part has the mean direction of its light.

use super::Planes;
use super::screen::Screen;
use super::search::{Beams, Slice};
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::search::{ArcsParams, noise_of};
use glam::DVec3;
use std::f64::consts::PI;

const SECTORS: f64 = 32.0;
/// How far a plane may miss a place on the same surface: share of the step on the plane.
const CONNECTED: f64 = 0.7;
/// Least cosine between a normal and a ray that a plane is followed at.
const MOST_GRAZING: f64 = 0.2;
/// How far depth may bend over a pixel whose normal comes from it: share of its change, and of the depth.
const BEND: f64 = 0.5;
const ROUGHNESS: f64 = 1e-5;
/// Least squared sine between the ways to a pixel's neighbours that a normal is made of.
const LEAST_SPREAD: f64 = 1e-9;
/// Largest component of a stored normal: a whole number of ten bits.
const LENGTH: f64 = 511.0;
/// Light is hidden by less than these (share of the AO radius).
const GAPS: [f64; 3] = [0.1, 0.3, 4.0];

/// Light lost for each share.
fn weights(arcs: &ArcsParams) -> [f64; 5] {
    [arcs.hit, arcs.hidden_close, arcs.hidden_middle, arcs.hidden_deep, arcs.off].map(f64::from)
}

/// 9xHxW before any filter: visibility, shares and bend. 1 and 0 on the background.
pub(super) fn planes(arcs: &ArcsParams, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let screen = Screen::new(gbuffer, params);
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let of = |i: usize| match gbuffer.is_foreground(i) {
        true => screen.planes(arcs, i % width, i / width),
        false => [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    };
    let pixels: Vec<_> = (0..width * height).map(of).collect();
    Planes::from_fn((9, height, width), |c, y, x| pixels[y * width + x][c] as f32)
}

/// 5xHxW shares before any filter: hit, hidden by less than each gap but not by less than the one before, off; 0 on the background.
#[cfg(test)]
pub(super) fn shares(arcs: &ArcsParams, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let found = planes(arcs, gbuffer, params);
    Planes::from_fn((5, found.height, found.width), |c, y, x| found.at(c + 1, y as isize, x as isize))
}

/// What one pixel of every patch finds: the shares of light, 0 on the background, and 1 if there is a second layer. The pixel is the one
/// at (patch / 2, patch / 2) of the patch, or the last one of the frame.
pub(super) fn survey(
    arcs: &ArcsParams,
    gbuffer: &GBuffer,
    params: AoParams,
    ([columns, rows], patch): ([usize; 2], usize),
) -> Planes {
    let screen = Screen::new(gbuffer, params);
    let layers = f64::from(u8::from(gbuffer.second().is_some()));
    let of = |i: usize| {
        let cell = [i % columns, i / columns];
        let [x, y] = cell.map(|c| c * patch + patch / 2);
        let (x, y) = (x.min(gbuffer.width() - 1), y.min(gbuffer.height() - 1));
        match gbuffer.is_foreground(y * gbuffer.width() + x) {
            true => screen.looked(arcs, [x, y], noise_of(cell[0], cell[1])).0,
            false => [0.0; 5],
        }
    };
    let cells: Vec<_> = (0..columns * rows).map(of).collect();
    Planes::from_fn((6, rows, columns), |c, y, x| *cells[y * columns + x].get(c).unwrap_or(&layers) as f32)
}

/// One side of a slice.
struct Side<'a> {
    slice: &'a Slice,
    sign: f64,
    /// View space: the pixel, and from there towards the viewer.
    pixel: DVec3,
    viewer: DVec3,
    /// Cosine between the viewer and the lowest occluder that counts.
    lowest: f64,
    /// Light above the tangent plane.
    light: f64,
    /// In [-0.5, 0.5).
    dither: f64,
}

impl Side<'_> {
    /// Sectors between the viewer and a place: a whole number.
    fn sector(&self, place: DVec3) -> u32 {
        let offset = place - self.pixel;
        let cosine = offset.dot(self.viewer) / offset.length().max(1e-18);
        let light = self.slice.light_above(cosine.clamp(self.lowest, 1.0), self.sign);
        self.sector_below(light)
    }

    /// Sectors that hold so much light below the viewer: a whole number.
    fn sector_below(&self, light: f64) -> u32 {
        (light * SECTORS / self.light + self.dither).clamp(0.0, SECTORS).round_ties_even() as u32
    }

    /// The vector of the light that the side loses, by its sectors of each share and the light lost for each.
    fn lost_beam(&self, found: [u64; 5], weights: [f64; 5]) -> DVec3 {
        let tangent = self.slice.lowest(0.0, self.sign);
        let (mut lost, mut begin, mut above) = (DVec3::ZERO, 0, DVec3::ZERO);
        for part in 1..=8 {
            // Of a plane that faces the viewer, these parts hold an eighth of the light each.
            let way = 1.0 - (1.0 - f64::from(part) / 8.0).sqrt();
            let cosine = 1.0 + (tangent - 1.0) * way;
            let beam = self.slice.beam_above(self.viewer, cosine, self.sign);
            let end = match part {
                8 => SECTORS as u32,
                _ => self.sector_below(self.slice.light_above(cosine, self.sign)),
            };
            let count = |bits: u64| f64::from((bits & between(begin, end)).count_ones());
            let sectors: f64 = weights.iter().zip(found).map(|(weight, bits)| weight * count(bits)).sum();
            lost += (beam - above) * (sectors / f64::from(end - begin).max(1.0));
            (begin, above) = (end, beam);
        }
        lost
    }

    /// Whether a place lies within the AO radius.
    fn near(&self, seen: &Seen, radius: f64) -> bool {
        (seen.place - self.pixel).length() <= radius
    }

    /// Sectors between the viewer and an end of a way, or where the way leaves the AO radius if the end is beyond it.
    fn end(&self, end: &Seen, other: &Seen, radius: f64) -> u32 {
        if self.near(end, radius) {
            return end.sector;
        }
        let way = (end.place - other.place).normalize();
        let [_, leaves] = self.crossing(other.place, way, radius).expect("the other end is inside");
        self.sector(other.place + way * leaves)
    }

    /// Distances from a place at which a ray from there, of unit length, enters and leaves the sphere around the pixel.
    fn crossing(&self, place: DVec3, ray: DVec3, radius: f64) -> Option<[f64; 2]> {
        let offset = place - self.pixel;
        let (b, c) = (ray.dot(offset), offset.length_squared() - radius * radius);
        (b * b > c).then(|| [-b - (b * b - c).sqrt(), -b + (b * b - c).sqrt()])
    }
}

/// A place on a surface that a tap sees.
#[derive(Clone, Copy)]
struct Seen {
    layer: usize,
    place: DVec3,
    normal: DVec3,
    /// Away from the viewer, of unit length.
    ray: DVec3,
    sector: u32,
}

/// Whether the plane of one place predicts another one.
fn predicts(from: &Seen, to: &Seen) -> bool {
    // How far the ray of `to` goes on from there to the plane.
    let facing = to.ray.dot(from.normal);
    let beyond = (from.place - to.place).dot(from.normal) / facing;
    let met = to.place + to.ray * beyond;
    met.z < 0.0 && beyond.abs() < CONNECTED * (met - from.place).length()
}

/// Bits from one sector up to, not including, the other.
fn between(a: u32, b: u32) -> u64 {
    let (low, high) = (a.min(b), a.max(b));
    ((1 << high) - 1) & !((1u64 << low) - 1)
}

impl Screen<'_> {
    /// Visibility, shares and bend of a pixel.
    fn planes(&self, params: &ArcsParams, x: usize, y: usize) -> [f64; 9] {
        let (shares, lost) = self.looked(params, [x, y], noise_of(x, y));
        let gone: f64 = shares.iter().zip(weights(params)).map(|(share, weight)| share * weight).sum();
        let share = (1.0 - gone).clamp(0.0, 1.0);
        let powered = share.powf(f64::from(params.power));
        let bend = lost.bend(self.normal(x, y), params.slices, [share, powered]);
        let [hit, close, middle, deep, off] = shares;
        [powered, hit, close, middle, deep, off, bend.x, bend.y, bend.z]
    }

    /// Shares of a pixel's light, and the vectors of its light.
    fn looked(&self, params: &ArcsParams, [x, y]: [usize; 2], noise: [f32; 2]) -> ([f64; 5], Beams) {
        let (normal, viewer) = (self.normal(x, y), self.lens.to_viewer(x, y));
        let [turn, jitter] = noise.map(f64::from);
        let bias = f64::from(params.angle_bias).to_radians();
        let (mut shares, mut open, mut beams) = ([0.0; 5], 0.0, Beams::default());
        for s in 0..params.slices {
            let slice = Slice::new(normal, viewer, (turn + f64::from(s)) * PI / f64::from(params.slices));
            let dither = (jitter * 7.0 + f64::from(s) * 0.414_214).fract() - 0.5;
            let jitter = (jitter + f64::from(s) * 0.618_034).fract();
            for sign in [1.0, -1.0] {
                let light = slice.light_above(slice.lowest(0.0, sign), sign).max(1e-6);
                let lowest = slice.lowest(bias, sign);
                let pixel = self.lens.position(x, y, self.depth(x, y));
                let side = Side { slice: &slice, sign, pixel, viewer, lowest, light, dither };
                let found = self.found_on(params, [x, y], &side, jitter);
                let light = light * slice.normal_length;
                for (share, bits) in shares.iter_mut().zip(found) {
                    *share += f64::from(bits.count_ones()) * light / SECTORS;
                }
                open += light;
                beams.lost += slice.normal_length * side.lost_beam(found, weights(params));
                beams.open += slice.normal_length * slice.sky(viewer, sign);
            }
        }
        (shares.map(|share| share / open), beams)
    }

    /// Sectors of each share on one side of a slice.
    fn found_on(&self, params: &ArcsParams, [x, y]: [usize; 2], side: &Side<'_>, jitter: f64) -> [u64; 5] {
        let reach_px = self.lens.projected_px(self.radius, self.depth(x, y));
        let layers = if self.gbuffer.second().is_some() { 2 } else { 1 };
        let [along, up] = side.slice.direction;
        // Hit, hidden by each gap, off.
        let mut bits = [0u64; 5];
        let ray = -side.viewer;
        let itself =
            Seen { layer: 0, place: side.pixel, normal: self.normal(x, y), ray, sector: SECTORS as u32 };
        let earlier_steps = params.earlier_steps(layers);
        let mut before = vec![vec![itself]];
        for step in 0..params.steps {
            let share = (jitter + f64::from(step)) / f64::from(params.steps);
            let pixels = side.sign
                * (share.powf(f64::from(params.distribution)) * reach_px).max(1.0 + f64::from(step));
            let [right, down] = [along * pixels * self.lens.columns_for_a_row(), -up * pixels];
            let at = [x as f64 + right, y as f64 + down];
            let [column, row] = [x as f64 + right.round_ties_even(), y as f64 + down.round_ties_even()];
            let (width, height) = (self.gbuffer.width() as f64, self.gbuffer.height() as f64);
            if !((0.0..width).contains(&column) && (0.0..height).contains(&row)) {
                let place = self.lens.place(at, self.depth(x, y));
                let ray = self.lens.ray(at);
                if let Some(ways) = side.crossing(place, ray, self.radius) {
                    let [high, low] = ways.map(|way| side.sector(place + ray * way));
                    bits[4] |= between(high, low);
                }
                before = [vec![vec![]], before].concat();
                continue;
            }
            let mut now = Vec::new();
            for layer in 0..layers {
                let Some(seen) = self.seen(side, [column as usize, row as usize], at, layer) else {
                    continue;
                };
                now.push(seen);
                for earlier in before.iter().take(earlier_steps).flatten() {
                    let [from, to] = [earlier, &seen].map(|end| side.near(end, self.radius));
                    let [forth, back] = [predicts(earlier, &seen), predicts(&seen, earlier)];
                    // With two layers, arcs between layers and over the border of the AO radius need both planes.
                    let one_is_enough = layers == 1 || earlier.layer == layer && from && to;
                    if (from || to) && (forth && back || one_is_enough && (forth || back)) {
                        // Arcs end where they leave the AO radius.
                        let ends = [(earlier, &seen), (&seen, earlier)];
                        let [a, b] = ends.map(|(end, other)| side.end(end, other, self.radius));
                        bits[0] |= between(a, b);
                    }
                }
                if side.near(&seen, self.radius) {
                    let [_, leaves] =
                        side.crossing(seen.place, seen.ray, self.radius).expect("inside the sphere");
                    // Only the last layer hides more than what passes close behind it.
                    let gaps = if layer + 1 == layers { &GAPS[..] } else { &GAPS[..1] };
                    for (bits, gap) in bits[1..4].iter_mut().zip(gaps) {
                        let end = side.sector(seen.place + seen.ray * leaves.min(gap * self.radius));
                        *bits |= between(seen.sector, end);
                    }
                }
            }
            before = [vec![now], before].concat();
        }
        let mut counted = 0;
        bits.map(|bits| {
            let new = bits & !counted;
            counted |= bits;
            new
        })
    }

    /// What a place of the screen sees in a layer, by the pixel nearest to it.
    fn seen(&self, side: &Side<'_>, [column, row]: [usize; 2], at: [f64; 2], layer: usize) -> Option<Seen> {
        let (depth, normal) = match layer {
            0 => (self.depth(column, row), self.normal_in_front(column, row)),
            _ => (self.depth_behind(column, row), self.normal_behind(column, row)),
        };
        if !depth.is_finite() {
            return None;
        }
        // A steep plane magnifies what rounding takes.
        let normal = (normal * LENGTH).round() / LENGTH;
        // The place at the same depth moves along its ray until it is on the pixel's plane.
        let (place, ray) = (self.lens.place(at, depth), self.lens.ray(at));
        let beside = (place - self.lens.position(column, row, depth)).dot(normal);
        let per_depth = 1.0 / -ray.z;
        let facing = (ray.dot(normal) * per_depth).min(-MOST_GRAZING);
        let place = place - ray * per_depth * (beside / facing);
        Some(Seen { layer, place, normal, ray, sector: side.sector(place) })
    }

    /// Unit normal of the first layer: across the differences of its neighbours on each axis if depth is straight over the pixel on both,
    /// else the frame's.
    fn normal_in_front(&self, x: usize, y: usize) -> DVec3 {
        let (width, height) = (self.gbuffer.width(), self.gbuffer.height());
        if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
            return self.normal(x, y);
        }
        let depth = |x, y| self.depth(x, y).min(1e16);
        let place = |x, y| self.lens.position(x, y, depth(x, y));
        let here = depth(x, y);
        let straight = |before: f64, after: f64| {
            let (to, from) = (here - before, after - here);
            (to - from).abs() <= BEND * (to.abs() + from.abs()) + ROUGHNESS * here
        };
        let across = (place(x + 1, y) - place(x - 1, y)).normalize_or_zero();
        let down = (place(x, y + 1) - place(x, y - 1)).normalize_or_zero();
        let found = down.cross(across);
        let both = straight(depth(x - 1, y), depth(x + 1, y)) && straight(depth(x, y - 1), depth(x, y + 1));
        if both && found.length_squared() >= LEAST_SPREAD { found.normalize() } else { self.normal(x, y) }
    }

    fn depth_behind(&self, x: usize, y: usize) -> f64 {
        let second = self.gbuffer.second().expect("a second layer");
        f64::from(second.depth[y * self.gbuffer.width() + x])
    }

    /// Unit normal of the second layer: across the differences to the nearer of the neighbours on each axis, of either layer.
    fn normal_behind(&self, x: usize, y: usize) -> DVec3 {
        let (width, height) = (self.gbuffer.width(), self.gbuffer.height());
        let here = self.depth_behind(x, y);
        let near = |[x, y]: [usize; 2]| {
            let [a, b] = [self.depth(x, y), self.depth_behind(x, y)];
            if (a - here).abs() < (b - here).abs() { a } else { b }
        };
        let itself = self.lens.position(x, y, here);
        let place = |[x, y]: [usize; 2]| self.lens.position(x, y, near([x, y]));
        let step = |before: Option<[usize; 2]>, after: Option<[usize; 2]>| {
            let change = |at: [usize; 2]| (near(at) - here).abs();
            let [b, a] = [before, after].map(|at| at.map_or(f64::INFINITY, change));
            match (before, after) {
                (Some(before), _) if b <= a && b.is_finite() => Some(itself - place(before)),
                (_, Some(after)) if a.is_finite() => Some(place(after) - itself),
                _ => None,
            }
        };
        let across = step((x > 0).then(|| [x - 1, y]), (x + 1 < width).then_some([x + 1, y]));
        let down = step((y > 0).then(|| [x, y - 1]), (y + 1 < height).then_some([x, y + 1]));
        match (across, down) {
            (Some(across), Some(down)) => down.cross(across).normalize_or(DVec3::Z),
            _ => DVec3::Z,
        }
    }
}
