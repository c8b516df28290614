//! GTAO: two horizons a slice and the exact light between them.
// Jimenez, Wu, Pesce, Jarabo 2016, Practical Real-Time Strategies for Accurate Indirect Occlusion; parameters and
// presets as in Intel's XeGTAO 1.30. Where ours differs: a slice's light is divided by what it would be if open, so that
// a plane is exactly 1; taps beside the slice are moved into it; taps outside the frame are skipped.

use super::bent::{BEAM, BENT_PLANES, Sums, open_beam};
use super::noise::noise_at;
use super::params::filtered_params;
use super::pyramid::{Pyramid, Range};
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use super::{PixelMethod, PixelShares};
use crate::simd::Simd;
use crate::simd::lanes::F;

filtered_params! {
    /// Parameters of GTAO. The defaults are XeGTAO's preset "High".
    GtaoParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 3 in 1..=64,
        /// The radius of the search, as a factor on the AO radius: makes up for the fall-off.
        radius_scale: f32 = 1.457 in 0.1..=4.0,
        /// Part of the radius over which an occluder fades out; 0 is a hard end.
        falloff: f32 = 0.615 in 0.0..=1.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 2.0 in 1.0..=4.0,
        /// Stretches depth differences by 1 plus this before the fall-off: above 0, thin things darken less of what is behind
        /// them.
        thin_occluder: f32 = 0.0 in 0.0..=4.0,
        /// Exponent on the visibility.
        power: f32 = 2.2 in 0.2..=4.0,
        /// Levels of the depth pyramid; 1 is none.
        depth_levels: u32 = 5 in 1..=5,
        /// Taps farther than two to the power of it (px) come from coarser levels.
        depth_offset: f32 = 3.3 in 0.0..=8.0,
    }
}

impl GtaoParams {
    /// XeGTAO's quality presets: "Low", "Medium", "High" and "Ultra" by slices and steps.
    pub const QUALITY: [(&'static str, u32, u32); 4] =
        [("low", 1, 2), ("medium", 2, 2), ("high", 3, 3), ("ultra", 9, 3)];

    /// Which depths count in a cell of the pyramid, for an AO radius (world units).
    // XeGTAO looks at three quarters of the radius when it builds the pyramid.
    pub(crate) fn pyramid_range(&self, radius: f32) -> Range {
        Range { reach: 0.75 * (radius * self.radius_scale), soft: self.falloff }
    }
}

/// One side of a slice.
struct Side<S: Simd> {
    /// 1 along the slice, -1 against it.
    sign: f32,
    /// Cosine between the viewer and the tangent plane.
    lowest: F<S>,
}

/// GTAO of one frame.
pub(crate) struct Gtao<'a> {
    screen: &'a Screen<'a>,
    params: GtaoParams,
    pyramid: &'a Pyramid,
    /// (world units)
    radius: f32,
    /// How fast an occluder fades out (share a world unit).
    fade: f32,
}

impl<'a> Gtao<'a> {
    /// `pyramid` is that of the frame.
    pub(crate) fn new(screen: &'a Screen<'a>, params: GtaoParams, pyramid: &'a Pyramid) -> Self {
        let radius = screen.radius * params.radius_scale;
        let fade = 1.0 / (params.falloff.max(1e-3) * radius);
        Self { screen, params, pyramid, radius, fade }
    }

    /// Cosine between the viewer and the highest occluder on both sides, the tangent plane at least.
    #[inline(always)]
    fn highest<S: Simd>(&self, p: &Pixels<S>, slice: &Slice<S>, jitter: F<S>) -> [F<S>; 2] {
        let sides = [Side { sign: 1.0, lowest: -slice.sin_n }, Side { sign: -1.0, lowest: slice.sin_n }];
        let [mut right, mut left] = sides.each_ref().map(|side| side.lowest);
        let reach = p.radius_px * self.params.radius_scale;
        for k in 0..self.params.steps {
            let share =
                taper((jitter + k as f32) * (1.0 / self.params.steps as f32), self.params.distribution);
            let pixels = (share * reach).max(1.0 + k as f32);
            right = right.max(self.occluder(p, slice, pixels, &sides[0]));
            left = left.max(self.occluder(p, slice, pixels, &sides[1]));
        }
        [right, left]
    }

    /// Cosine between the viewer and the surface so many pixels away on one side. A surface that is too far away fades to the
    /// side's lowest horizon.
    #[inline(always)]
    fn occluder<S: Simd>(&self, p: &Pixels<S>, slice: &Slice<S>, pixels: F<S>, side: &Side<S>) -> F<S> {
        let Side { sign, lowest } = *side;
        let tap = self.pyramid.tap(self.screen, slice.place(p, pixels * sign), pixels);
        let at = slice.project(p, &tap);
        let felt = if self.params.thin_occluder == 0.0 {
            at.squared * at.inverse_distance
        } else {
            let before = at.towards * (1.0 + self.params.thin_occluder);
            before.mul_add(before, at.along * at.along).sqrt()
        };
        let weight = tap.inside.select(felt.mul_add(-self.fade, self.radius * self.fade).saturate(), 0.0);
        at.towards.mul_add(at.inverse_distance, -lowest).mul_add(weight, lowest)
    }

    /// Sums over the slices of the pixels from (`x`, `y`) on.
    #[inline(always)]
    fn sums<S: Simd, const N: usize>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> Sums<S, N> {
        let simd = p.x.simd();
        let [turn, jitter] = noise_at(simd, x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let mut sums = Sums::new(simd);
        for s in 0..self.params.slices {
            let slice = Slice::new(p, (turn + s as f32) * inverse);
            // The golden ratio keeps the slices' taps apart.
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            let [right, left] = self.highest(p, &slice, jitter);
            let (right, left) = (slice.beam_above::<N>(right, 1.0), slice.beam_above::<N>(left, -1.0));
            let mut lost = open_beam(&slice);
            for c in 0..N {
                lost[c] -= right[c] + left[c];
            }
            sums.add(p, &slice, lost);
        }
        sums
    }
}

impl PixelMethod for Gtao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> F<S> {
        self.sums::<S, 1>(p, at).visibility(self.params.power)
    }
}

impl PixelShares<BENT_PLANES> for Gtao<'_> {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; BENT_PLANES] {
        self.sums::<S, BEAM>(p, at).planes(p, self.params.slices, self.params.power)
    }
}

/// `t` in [0, 1] to the power of `exponent`.
#[inline(always)]
pub(crate) fn taper<S: Simd>(t: F<S>, exponent: f32) -> F<S> {
    if exponent == 2.0 { t * t } else { power(t, exponent) }
}

/// `v` in [0, 1] to the power of `exponent`.
#[inline(always)]
pub(crate) fn power<S: Simd>(v: F<S>, exponent: f32) -> F<S> {
    if exponent == 1.0 { v } else { (v.max(1e-20).log2() * exponent).exp2() }
}
