//! Visibility bitmask: the occluded part of a slice as a set of sectors, so that light passes behind occluders.
// Therrien, Levesque, Gilet 2023, Screen Space Indirect Lighting with Visibility Bitmask; what Bevy ships as SSAO. The
// sectors there are equal angles; with `cosine` ours are equal shares of the slice's cosine-weighted light. The
// thickness there is a length in the world; here it is a share of the AO radius. A second layer is a slab of its own, as thick
// as the first.

use super::PixelMethod;
use super::gtao::{power, taper};
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen, Tap};
use super::slice::Slice;
use crate::simd::Simd;
use crate::simd::integers::{Integer, U};
use crate::simd::lanes::F;
use std::f32::consts::{FRAC_PI_2, PI};

filtered_params! {
    /// Parameters of the visibility bitmask. The defaults are Bevy's preset "High".
    VbaoParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 3 in 1..=64,
        /// How thick occluders are taken to be (share of the AO radius): less lets more light pass behind.
        thickness: f32 = 0.25 in 0.001..=10.0,
        /// The radius of the search, as a factor on the AO radius.
        radius_scale: f32 = 1.0 in 0.1..=4.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 1.0 in 1.0..=4.0,
        /// 1: sectors of equal cosine-weighted light. 0: of equal angle.
        cosine: u32 = 0 in 0..=1,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl VbaoParams {
    /// Bevy's quality presets by slices and samples on each side.
    pub const QUALITY: [(&'static str, u32, u32); 4] =
        [("low", 1, 2), ("medium", 2, 2), ("high", 3, 3), ("ultra", 9, 3)];
}

/// Sectors of a slice: the bits of a word.
pub(crate) const SECTORS: f32 = 32.0;

/// The bitmask of one frame.
pub(crate) struct Vbao<'a> {
    screen: &'a Screen<'a>,
    params: VbaoParams,
    /// Depths of the second layer, if there is one.
    second: Option<&'a [f32]>,
}

impl<'a> Vbao<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: VbaoParams) -> Self {
        let second = screen.gbuffer().second().map(|second| &*second.depth);
        Self { screen, params, second }
    }

    /// The occluded sectors of a slice.
    #[inline(always)]
    fn occluded<S: Simd>(&self, p: &Pixels<S>, slice: &Slice<S>, jitter: F<S>) -> U<S> {
        let mut occluded = F::new(jitter.simd(), 0.0).bits();
        let reach = p.radius_px * self.params.radius_scale;
        let bounds = Bounds::new(slice);
        for k in 0..self.params.steps {
            let share =
                taper((jitter + k as f32) * (1.0 / self.params.steps as f32), self.params.distribution);
            let pixels = (share * reach).max(1.0 + k as f32);
            for sign in [1.0, -1.0] {
                occluded = occluded | self.behind_tap(p, &bounds, pixels, sign);
            }
        }
        occluded
    }

    /// The sectors that a tap so many pixels away on one side occludes: the slab that each layer is.
    #[inline(always)]
    fn behind_tap<S: Simd>(&self, p: &Pixels<S>, bounds: &Bounds<'_, S>, pixels: F<S>, sign: f32) -> U<S> {
        let tap = self.screen.tap(bounds.slice.place(p, pixels * sign));
        let first = self.behind_front(p, bounds, &tap, sign);
        match self.second {
            Some(depths) => {
                let second = Tap { position: self.screen.behind(&tap, depths), ..tap };
                first | self.behind_front(p, bounds, &second, sign)
            }
            None => first,
        }
    }

    /// The sectors behind a surface, as far as it is taken to be thick.
    #[inline(always)]
    fn behind_front<S: Simd>(&self, p: &Pixels<S>, bounds: &Bounds<'_, S>, tap: &Tap<S>, sign: f32) -> U<S> {
        let radius = self.screen.radius * self.params.radius_scale;
        let thickness = self.screen.radius * self.params.thickness;
        let front = bounds.slice.project(p, tap);
        let behind = front.towards - thickness;
        let inverse_reach = behind.mul_add(behind, front.along * front.along).max(1e-36).inverse_sqrt();
        // Angles from the viewer; those behind are larger.
        let near = (front.towards * front.inverse_distance).acos() * sign;
        let far = (behind * inverse_reach).acos() * sign;
        let felt = tap.inside & front.squared.le(radius * radius);
        let (low, high) = if sign > 0.0 { (near, far) } else { (far, near) };
        let cosine = self.params.cosine == 1;
        let low = (bounds.share(low, cosine) * SECTORS).round();
        let high = (bounds.share(high, cosine) * SECTORS).round();
        felt.select(sectors(low, high).float_of_bits(), 0.0).bits()
    }
}

/// A slice and the light between the ends of its hemisphere.
struct Bounds<'a, S: Simd> {
    slice: &'a Slice<S>,
    /// Light below the lower end.
    low: F<S>,
    /// One over the light between the ends.
    inverse: F<S>,
}

impl<'a, S: Simd> Bounds<'a, S> {
    #[inline(always)]
    fn new(slice: &'a Slice<S>) -> Self {
        let low = signed_arc(slice, slice.n - FRAC_PI_2);
        let high = signed_arc(slice, slice.n + FRAC_PI_2);
        Self { slice, low, inverse: 1.0 / (high - low).max(1e-6) }
    }

    /// Share of the slice on the negative side of an angle from the viewer.
    #[inline(always)]
    fn share(&self, angle: F<S>, cosine: bool) -> F<S> {
        let slice = self.slice;
        if cosine {
            let angle = angle.max(slice.n - FRAC_PI_2).min(slice.n + FRAC_PI_2);
            ((signed_arc(slice, angle) - self.low) * self.inverse).saturate()
        } else {
            (angle - slice.n).mul_add(1.0 / PI, 0.5).saturate()
        }
    }
}

#[inline(always)]
fn signed_arc<S: Simd>(slice: &Slice<S>, angle: F<S>) -> F<S> {
    let (cos, sin) = angle.abs().min(PI).cos_sin_of_half_turn();
    let arc = slice.arc(angle, [cos, sin.with_sign_of(angle)]);
    angle.lt(0.0).select(-arc, arc)
}

/// Bits from `low` up to, not including, `high`; both in 0..=32.
#[inline(always)]
pub(crate) fn sectors<S: Simd>(low: U<S>, high: U<S>) -> U<S> {
    let all = u32::MAX.integer_lanes(low.simd());
    (all << low) & (all - (all << high))
}

impl PixelMethod for Vbao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let simd = p.x.simd();
        let [turn, jitter] = noise_at(simd, x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let (mut light, mut open) = (F::new(simd, 0.0), F::new(simd, 0.0));
        for s in 0..self.params.slices {
            let slice = Slice::new(p, (turn + s as f32) * inverse);
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            let occluded = self.occluded(p, &slice, jitter);
            let free = 1.0 - occluded.count_ones().float() * (1.0 / SECTORS);
            let weight =
                if self.params.cosine == 1 { slice.normal_length * slice.open() } else { F::new(simd, 1.0) };
            light += weight * free;
            open += weight;
        }
        power((light / open.max(1e-6)).saturate(), self.params.power)
    }
}
