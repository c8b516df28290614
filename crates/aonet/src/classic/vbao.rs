//! Visibility bitmask: the occluded part of a slice as a set of sectors, so that light passes behind occluders.
// Therrien, Levesque, Gilet 2023, Screen Space Indirect Lighting with Visibility Bitmask; what Bevy ships as SSAO. The
// sectors there are equal angles; with `cosine` ours are equal shares of the slice's cosine-weighted light. The
// thickness there is a length in the world; here it is a share of the AO radius.

use super::gtao::{power, taper};
use super::lanes::{F, LANES, Mask};
use super::noise::noise_at;
use super::params::params;
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use super::{Denoise, PixelMethod};
use std::f32::consts::{FRAC_PI_2, PI};

params! {
    /// Parameters of the visibility bitmask. The defaults are Bevy's preset "High".
    VbaoParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 3 in 1..=64,
        /// How thick occluders are taken to be [share of the AO radius]: less lets more light pass behind.
        thickness: f32 = 0.25 in 0.001..=10.0,
        /// The radius of the search, as a factor on the AO radius.
        radius_scale: f32 = 1.0 in 0.1..=4.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 1.0 in 1.0..=4.0,
        /// 1: sectors of equal cosine-weighted light. 0: of equal angle.
        cosine: u32 = 0 in 0..=1,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
        /// Passes of the edge-aware 5x5 filter.
        denoise_passes: u32 = 1 in 0..=4,
        /// Distance of a neighbour from the pixel's plane at which it stops counting [share of the AO radius].
        denoise_plane: f32 = 0.05 in 0.001..=2.0,
        /// Exponent on the cosine between the normals.
        denoise_normal: f32 = 4.0 in 0.0..=64.0,
    }
}

impl VbaoParams {
    /// Bevy's quality presets by slices and samples on each side.
    pub const QUALITY: [(&'static str, u32, u32); 4] =
        [("low", 1, 2), ("medium", 2, 2), ("high", 3, 3), ("ultra", 9, 3)];

    pub(crate) fn denoise(&self) -> Denoise {
        Denoise { passes: self.denoise_passes, plane: self.denoise_plane, normal: self.denoise_normal }
    }
}

/// Sectors of a slice: the bits of a word.
const SECTORS: f32 = 32.0;

/// The bitmask of one frame.
pub(crate) struct Vbao<'a> {
    screen: &'a Screen<'a>,
    params: VbaoParams,
}

impl<'a> Vbao<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: VbaoParams) -> Self {
        Self { screen, params }
    }

    /// The occluded sectors of a slice.
    #[inline(always)]
    fn occluded(&self, p: &Pixels, slice: &Slice, jitter: F) -> [u32; LANES] {
        let mut occluded = [0; LANES];
        let radius = self.screen.radius * self.params.radius_scale;
        let thickness = self.screen.radius * self.params.thickness;
        let bounds = Bounds::new(slice);
        for sign in [1.0, -1.0] {
            for k in 0..self.params.steps {
                let share =
                    taper((jitter + k as f32) * (1.0 / self.params.steps as f32), self.params.distribution);
                let pixels = (share * p.radius_px * self.params.radius_scale).max(1.0 + k as f32);
                let (px, py) = slice.place(p, pixels * sign);
                let tap = self.screen.tap(px, py);
                let front = slice.project(p, &tap);
                let behind = front.towards - thickness;
                let reach = (behind * behind + front.along * front.along).max(1e-36).sqrt();
                // Angles from the viewer; those behind are larger.
                let near = (front.towards / front.distance).acos() * sign;
                let far = (behind / reach).acos() * sign;
                let felt: Mask = tap.inside & front.distance.le(radius);
                let (low, high) = if sign > 0.0 { (near, far) } else { (far, near) };
                let sector =
                    |angle: F| (bounds.share(slice, angle, self.params.cosine == 1) * SECTORS).round();
                let bits = sectors(sector(low), sector(high));
                for i in 0..LANES {
                    occluded[i] |= bits[i] & felt.0[i];
                }
            }
        }
        occluded
    }
}

/// The light below the hemisphere's ends.
struct Bounds {
    low: F,
    inverse: F,
}

impl Bounds {
    #[inline(always)]
    fn new(slice: &Slice) -> Self {
        let low = signed_arc(slice, slice.n - FRAC_PI_2);
        let high = signed_arc(slice, slice.n + FRAC_PI_2);
        Self { low, inverse: 1.0 / (high - low).max(1e-6) }
    }

    /// Share of the slice on the negative side of an angle from the viewer.
    #[inline(always)]
    fn share(&self, slice: &Slice, angle: F, cosine: bool) -> F {
        if cosine {
            let angle = angle.max(slice.n - FRAC_PI_2).min(slice.n + FRAC_PI_2);
            ((signed_arc(slice, angle) - self.low) * self.inverse).saturate()
        } else {
            ((angle - slice.n) * (1.0 / PI) + 0.5).saturate()
        }
    }
}

#[inline(always)]
fn signed_arc(slice: &Slice, angle: F) -> F {
    let cos = angle.abs().min(PI).cos_sin_of_half_turn().0;
    let arc = slice.arc(angle, cos);
    angle.lt(0.0).select(-arc, arc)
}

/// Bits from `low` up to, not including, `high`; both whole and in 0..=32.
#[inline(always)]
fn sectors(low: F, high: F) -> [u32; LANES] {
    let (low, high) = (low.index(32), high.index(32));
    let mut bits = [0; LANES];
    for i in 0..LANES {
        let below = |n: u32| ((1u64 << n) - 1) as u32;
        bits[i] = below(high[i]) & !below(low[i]);
    }
    bits
}

impl PixelMethod for Vbao<'_> {
    #[inline(always)]
    fn visibility(&self, p: &Pixels, (x, y): (usize, usize)) -> F {
        let [turn, jitter] = noise_at(x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let (mut light, mut open) = (F::from(0.0), F::from(0.0));
        for s in 0..self.params.slices {
            let slice = Slice::new(p, (turn + s as f32) * inverse);
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            let occluded = self.occluded(p, &slice, jitter);
            let mut free = [0.0; LANES];
            for i in 0..LANES {
                free[i] = occluded[i].count_zeros() as f32 * (1.0 / SECTORS);
            }
            let weight =
                if self.params.cosine == 1 { slice.normal_length * slice.open() } else { F::from(1.0) };
            light += weight * F(free);
            open += weight;
        }
        power((light / open.max(1e-6)).saturate(), self.params.power)
    }
}
