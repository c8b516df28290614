//! Normals of both layers, one word a pixel, so that a tap reads them with one gather.

use super::screen::Screen;
use crate::error::Result;
use crate::frame::size::Size;
use crate::simd::Simd;
use crate::simd::aligned::Aligned;
use crate::simd::integers::U;
use crate::simd::vector::V3;
use crate::threads::Workers;
use glam::Vec3A;

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
    pub(crate) fn fill(&mut self, screen: &Screen<'_>, workers: &mut Workers) {
        pack(screen, workers, [&mut self.first, &mut self.second]);
    }

    /// The words of each layer.
    pub(crate) fn layers(&self) -> [&[f32]; 2] {
        [&self.first, &self.second]
    }
}

/// Packs the normals of a frame, HxW for each layer; leaves the second as it is if the frame has one layer.
pub(crate) fn pack(screen: &Screen<'_>, workers: &mut Workers, [first, second]: [&mut [f32]; 2]) {
    let (gbuffer, width) = (screen.gbuffer(), screen.size().width());
    workers.for_each_band(first, width, |band| {
        let normals = &gbuffer.normal()[band.first * width..];
        band.values.iter_mut().zip(normals).for_each(|(to, n)| *to = packed(*n));
    });
    let Some(layer) = gbuffer.second() else { return };
    workers.for_each_band(second, width, |band| {
        for (i, to) in band.values.iter_mut().enumerate() {
            *to = packed(normal_of_depth(screen, &layer.depth, band.first * width + i));
        }
    });
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
