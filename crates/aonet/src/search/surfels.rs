//! Normals of both layers, one word a pixel, so that a tap reads them with one gather.

use super::screen::{Screen, neighbours};
use crate::error::Result;
use crate::frame::BACKGROUND;
use crate::frame::size::Size;
use crate::simd::aligned::Aligned;
use crate::simd::integers::U;
use crate::simd::lanes::{F, Mask};
use crate::simd::vector::V3;
use crate::simd::{Isa, Kernel, MAX_LANES, Simd};
use crate::threads::Workers;
use glam::Vec3A;
use std::ops::Range;

/// Length of an unpacked normal, about. Its components are whole numbers.
pub(crate) const LENGTH: f32 = 511.0;

/// Packed normals of a frame: HxW for each layer.
#[derive(Debug)]
pub(crate) struct Surfels {
    first: Aligned,
    second: Aligned,
}

impl Surfels {
    /// Memory for frames of one size.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(size: Size) -> Result<Self> {
        Ok(Self { first: Aligned::zeros(size.pixels())?, second: Aligned::zeros(size.pixels())? })
    }

    /// Number of values.
    pub(crate) fn len(&self) -> usize {
        self.first.len() + self.second.len()
    }

    /// Packs a frame of this size.
    pub(crate) fn fill(&mut self, isa: Isa, screen: &Screen<'_>, workers: &mut Workers) {
        pack((isa, workers), screen, [&mut self.first, &mut self.second]);
    }

    /// The words of each layer.
    pub(crate) fn layers(&self) -> [&[f32]; 2] {
        [&self.first, &self.second]
    }
}

/// How far depth may bend over a pixel whose normal comes from it: share of its change from neighbour to neighbour.
pub(crate) const BEND: f32 = 0.5;
/// The same where depth does not change: share of the depth.
pub(crate) const ROUGHNESS: f32 = 1e-5;
/// Least squared sine between the ways to a pixel's neighbours that a normal is made of.
pub(crate) const LEAST_SPREAD: f32 = 1e-9;

/// Packs the normals of a frame, HxW for each layer; leaves the second as it is if the frame has one layer.
pub(crate) fn pack(
    (isa, workers): (Isa, &mut Workers),
    screen: &Screen<'_>,
    [first, second]: [&mut [f32]; 2],
) {
    let width = screen.size().width();
    workers.for_each_band(first, width, |band| {
        isa.run_on_pixels(FirstLayer { screen, first: band.first, words: band.values });
    });
    let Some(layer) = screen.gbuffer().second() else { return };
    workers.for_each_band(second, width, |band| {
        for (i, to) in band.values.iter_mut().enumerate() {
            *to = packed(normal_of_depth(screen, &layer.depth, band.first * width + i));
        }
    });
}

/// Rows of the first layer.
struct FirstLayer<'a> {
    screen: &'a Screen<'a>,
    /// Number of the first row.
    first: usize,
    words: &'a mut [f32],
}

impl Kernel for FirstLayer<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let width = self.screen.size().width();
        for (i, row) in self.words.chunks_exact_mut(width).enumerate() {
            for (k, words) in row.chunks_mut(S::LANES).enumerate() {
                packed_lanes(first_normal(simd, self.screen, (k * S::LANES, self.first + i))).store(words);
            }
        }
    }
}

/// Unit normal of the first layer at the pixels from (`x`, `y`) on, of any length on the background. It comes from depth where depth is
/// straight over the pixel. Elsewhere, and at the frame's border, it comes from the frame, whose normals may be those of smooth shading:
/// along the edges of round things they turn away from the view where the surface does not, and their planes lead far in front of it.
#[inline(always)]
fn first_normal<S: Simd>(simd: S, screen: &Screen<'_>, (x, y): (usize, usize)) -> V3<S> {
    let (p, size) = (screen.pixels(simd, x, y), screen.size());
    if y == 0 || y + 1 == size.height() {
        return p.normal;
    }
    let columns = x..x + S::LANES;
    let here = depths(simd, screen, columns.clone(), y);
    let (above, below) = (depths(simd, screen, columns.clone(), y - 1), depths(simd, screen, columns, y + 1));
    let left = if x > 0 {
        depths(simd, screen, x - 1..x - 1 + S::LANES, y)
    } else {
        let row = screen.row(screen.gbuffer().depth(), y);
        let columns: [usize; MAX_LANES] = std::array::from_fn(|k| k.saturating_sub(1).min(row.len() - 1));
        F::load(simd, &columns.map(|x| row[x])).min(BACKGROUND)
    };
    let right = depths(simd, screen, x + 1..x + 1 + S::LANES, y);
    let across = unit(screen.position(p.x + 1.0, p.y, right) - screen.position(p.x - 1.0, p.y, left));
    let down = unit(screen.position(p.x, p.y + 1.0, below) - screen.position(p.x, p.y - 1.0, above));
    let found = down.cross(across);
    let inside = !p.x.lt(1.0) & p.x.lt(size.width() as f32 - 1.0);
    let straight = straight([left, here, right]) & straight([above, here, below]);
    let spread = !found.dot(found).lt(LEAST_SPREAD);
    V3::choose(inside & straight & spread, [unit(found), p.normal])
}

/// Depth of consecutive columns of a row of the frame, at most [`BACKGROUND`].
#[inline(always)]
fn depths<S: Simd>(simd: S, screen: &Screen<'_>, columns: Range<usize>, y: usize) -> F<S> {
    let mut edge = [0.0; MAX_LANES];
    let row = screen.row(screen.gbuffer().depth(), y);
    F::load(simd, neighbours(row, columns, &mut edge)).min(BACKGROUND)
}

/// Whether depth is straight from a neighbour over a pixel to the other one.
#[inline(always)]
fn straight<S: Simd>([before, here, after]: [F<S>; 3]) -> Mask<S> {
    let (to, from) = (here - before, after - here);
    (to - from).abs().le((to.abs() + from.abs()).mul_add(BEND, here * ROUGHNESS))
}

#[inline(always)]
fn unit<S: Simd>(v: V3<S>) -> V3<S> {
    v * v.dot(v).max(f32::MIN_POSITIVE).inverse_sqrt()
}

/// [`packed`], lane by lane.
#[inline(always)]
fn packed_lanes<S: Simd>(normal: V3<S>) -> F<S> {
    let word = |c: F<S>| c.max(-1.0).min(1.0).mul_add(LENGTH, LENGTH).round();
    (word(normal.x) << 20 | word(normal.y) << 10 | word(normal.z)).float_of_bits()
}

/// Ten bits for each component of a unit vector, in the bits of a float.
pub(crate) fn packed(normal: [f32; 3]) -> f32 {
    let [x, y, z] = normal.map(|c| (c.clamp(-1.0, 1.0) * LENGTH + LENGTH).round() as u32);
    f32::from_bits(x << 20 | y << 10 | z)
}

/// A packed normal, [`LENGTH`] times as long.
#[inline(always)]
pub(crate) fn unpacked<S: Simd>(word: U<S>) -> V3<S> {
    V3 {
        x: (word >> 20).float() - LENGTH,
        y: ((word >> 10) & 1023).float() - LENGTH,
        z: (word & 1023).float() - LENGTH,
    }
}

/// Unit normal of the second layer at a pixel, through its nearer neighbours in depth, towards the viewer; zero on the background. Behind a
/// thin thing that surface goes on in the first layer of the pixels beside it, so neighbours are of either layer.
pub(super) fn normal_of_depth(screen: &Screen<'_>, depth: &[f32], i: usize) -> [f32; 3] {
    let (width, height) = (screen.size().width(), screen.size().height());
    let (x, y, here) = (i % width, i / width, depth[i]);
    if here == f32::INFINITY {
        return [0.0; 3];
    }
    let (camera, first) = (screen.gbuffer().camera(), screen.gbuffer().depth());
    // Difference in depth of a neighbour, in the layer that is nearer to the pixel, and that depth.
    let nearer = |j: usize| {
        let [a, b] = [first[j], depth[j]].map(|depth| ((depth - here).abs(), depth));
        if a.0 < b.0 { a } else { b }
    };
    let none = (f32::INFINITY, f32::INFINITY);
    let itself = camera.position_view(x, y, here);
    // From the pixel's left or upper neighbour to the pixel, or from the pixel to the other one.
    let way = |before: (f32, f32), after: (f32, f32), [columns, rows]: [usize; 2]| {
        if before.0.min(after.0) == f32::INFINITY {
            None
        } else if before.0 <= after.0 {
            Some(itself - camera.position_view(x - columns, y - rows, before.1))
        } else {
            Some(camera.position_view(x + columns, y + rows, after.1) - itself)
        }
    };
    let left = if x > 0 { nearer(i - 1) } else { none };
    let right = if x + 1 < width { nearer(i + 1) } else { none };
    let above = if y > 0 { nearer(i - width) } else { none };
    let below = if y + 1 < height { nearer(i + width) } else { none };
    let (across, down) = (way(left, right, [1, 0]), way(above, below, [0, 1]));
    let normal = match (across, down) {
        (Some(across), Some(down)) => down.cross(across).normalize_or(Vec3A::Z),
        _ => Vec3A::Z,
    };
    normal.to_array()
}
