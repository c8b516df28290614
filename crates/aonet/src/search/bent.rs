//! Bent normals: the mean direction of the light that reaches a pixel, from what a search leaves of its slices.
// The idea: Jimenez et al. 2016 and XeGTAO 1.30 (Intel). They sum up what is open in every slice. Here, the sum is corrected by
// what it is worth on an open plane, as far as the pixel is open: so a plane's bent normal is its normal, however few slices.

use super::gtao::power;
use super::screen::Pixels;
use super::shares::PLANES;
use super::slice::Slice;
use crate::error::{Error, Result};
use crate::frame::bent_normals::BentNormals;
use crate::frame::gbuffer::GBuffer;
use crate::frame::window::Window;
use crate::simd::Simd;
use crate::simd::lanes::F;
use crate::simd::vector::V3;
use crate::threads::Workers;

/// Values of a bend: a vector (x, y, z) in view space. The bent normal is the direction of the normal times the visibility, plus the
/// bend: so a filter of both leaves the normals as sharp as they are.
pub(crate) const BEND: usize = 3;
/// What a search with bent normals writes for a pixel: the visibility, then the bend.
pub(crate) const BENT_PLANES: usize = 1 + BEND;
/// The same of a search that reports shares: the visibility, then the shares, then the bend.
pub(crate) const BENT_SHARES: usize = PLANES + BEND;

/// Values of a beam: the light, and its vector towards the viewer and along the slice. See [`Slice::beam_above`].
pub(crate) const BEAM: usize = 3;

/// Shortest sum of open directions, where the longest is 1, that has a direction.
pub(crate) const SHORTEST: f32 = 1e-4;

/// Vectors of light, sums over the slices of a pixel.
pub(crate) struct Beams<S: Simd> {
    /// Of the light that is lost.
    lost: V3<S>,
    /// For the vector of the open sky: every slice's "along", as long as the normal leans there.
    leaning: V3<S>,
}

impl<S: Simd> Beams<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let zero = F::new(simd, 0.0);
        let none = V3 { x: zero, y: zero, z: zero };
        Self { lost: none, leaning: none }
    }

    /// Adds a slice and the vector of the light that it loses: towards the viewer, and along.
    #[inline(always)]
    pub(crate) fn add(&mut self, p: &Pixels<S>, slice: &Slice<S>, lost: [F<S>; 2]) {
        let (towards, along) = (slice.normal_length * lost[0], slice.normal_length * lost[1]);
        self.lost = p.to_viewer.mul_add(towards, slice.along.mul_add(along, self.lost));
        self.leaning = slice.along.mul_add(slice.normal_length * slice.sin_n, self.leaning);
    }

    /// The bend of pixels with so many slices, by the share of their light that is not lost, and that share with its power.
    #[inline(always)]
    pub(crate) fn bend(&self, p: &Pixels<S>, slices: u32, [share, powered]: [F<S>; 2]) -> V3<S> {
        // The vector of an open slice: 2/3 cos n towards the viewer and 4/3 sin n along; the sum of all is 2/3 of the normal each.
        let facing = p.normal.dot(p.to_viewer) * slices as f32;
        let open = p.to_viewer.mul_add(facing, self.leaning * 2.0);
        let bend = open * (1.0 - share) + self.lost * -1.5;
        // The normal comes times the visibility with its power.
        bend * (powered / share.max(1e-6) * (1.0 / slices as f32))
    }
}

/// Sums over the slices of a pixel; the vectors only for N = [`BEAM`].
pub(crate) struct Sums<S: Simd, const N: usize> {
    /// Light that is lost, and light when nothing occludes.
    lost: F<S>,
    open: F<S>,
    beams: Beams<S>,
}

impl<S: Simd, const N: usize> Sums<S, N> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let zero = F::new(simd, 0.0);
        Self { lost: zero, open: zero, beams: Beams::new(simd) }
    }

    /// Adds a slice and the beam that it loses.
    #[inline(always)]
    pub(crate) fn add(&mut self, p: &Pixels<S>, slice: &Slice<S>, lost: [F<S>; N]) {
        self.lost += slice.normal_length * lost[0];
        self.open += slice.normal_length * slice.open();
        if N == BEAM {
            self.beams.add(p, slice, [lost[1], lost[2]]);
        }
    }

    /// The share of the light that is not lost.
    #[inline(always)]
    fn share(&self) -> F<S> {
        (1.0 - self.lost / self.open.max(1e-6)).saturate()
    }

    /// Visibility: that share to the power of an exponent.
    #[inline(always)]
    pub(crate) fn visibility(&self, exponent: f32) -> F<S> {
        power(self.share(), exponent)
    }
}

impl<S: Simd> Sums<S, BEAM> {
    /// Visibility and bend of pixels with so many slices.
    #[inline(always)]
    pub(crate) fn planes(&self, p: &Pixels<S>, slices: u32, exponent: f32) -> [F<S>; BENT_PLANES] {
        let share = self.share();
        let powered = power(share, exponent);
        let bend = self.beams.bend(p, slices, [share, powered]);
        [powered, bend.x, bend.y, bend.z]
    }
}

/// The vector of a slice's light when nothing occludes, in the order of a beam.
#[inline(always)]
pub(crate) fn open_beam<S: Simd, const N: usize>(slice: &Slice<S>) -> [F<S>; N] {
    let mut beam = [slice.open(); N];
    if N == BEAM {
        beam[1] = slice.cos_n * (2.0 / 3.0);
        beam[2] = slice.sin_n * (4.0 / 3.0);
    }
    beam
}

/// # Errors
/// When the session has no bent normals, or the image another size than its picture.
pub(crate) fn check(has_bent_normals: bool, window: Window, bent: &BentNormals) -> Result<()> {
    if !has_bent_normals {
        let expected = "one of Session::with_bent_normals";
        return Err(Error::value("session with bent normals", expected, "one without"));
    }
    window.size().expect("bent normals of a session", bent.size())
}

/// Writes the bent normals of a picture from the planes that a search with bent normals found: the first and the last ones. Allocates
/// nothing.
pub(crate) fn write(workers: &mut Workers, gbuffer: &GBuffer, found: &[f32], bent: &mut BentNormals) {
    let (window, buffer_width) = (gbuffer.window(), gbuffer.width());
    let (margin, width) = (window.margin(), window.size().width());
    let row_len = found.len() / gbuffer.height();
    let bend = row_len / buffer_width - BEND;
    workers.for_each_band(bent.directions_mut().as_flattened_mut(), width * 3, |band| {
        for (i, line) in band.values.chunks_exact_mut(width * 3).enumerate() {
            let y = band.first + i;
            let planes = &found[(margin.y + y) * row_len..][..row_len];
            let plane = |c: usize| &planes[c * buffer_width + margin.x..][..width];
            let [v, x, y_bend, z] = [0, bend, bend + 1, bend + 2].map(plane);
            let (normals, depths) = (window.row(gbuffer.normal(), y), window.row(gbuffer.depth(), y));
            for (k, to) in line.chunks_exact_mut(3).enumerate() {
                let bend = [x[k], y_bend[k], z[k]];
                let sum = [0, 1, 2].map(|c| v[k] * normals[k][c] + bend[c]);
                let open = if depths[k] == f32::INFINITY { [0.0; 3] } else { directed(sum, normals[k]) };
                to.copy_from_slice(&open);
            }
        }
    });
}

/// The direction of a sum of open directions; the normal where there are none.
fn directed([x, y, z]: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    if length > SHORTEST { [x / length, y / length, z / length] } else { normal }
}
