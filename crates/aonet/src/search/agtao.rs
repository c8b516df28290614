//! GTAO that fades every occluder by its own distance instead of one horizon.
// Ours: from GTAO (Jimenez et al. 2016) the light between two angles of a slice, from HBAO (Bavoil et al. 2008) the walk
// along it. Where the horizon rises, the light of that rise is lost, the less of it the farther away the occluder is:
// a distant wall no longer hides what a near edge takes, as the highest horizon alone would have it.

use super::bent::{BEAM, BENT_PLANES, Sums};
use super::cubic::Spacing;
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use super::stride::Stride;
use super::{PixelMethod, PixelShares};
use crate::simd::Simd;
use crate::simd::lanes::F;
use std::f32::consts::PI;

filtered_params! {
    /// Parameters of attenuated GTAO.
    AgtaoParams {
        /// Slices a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps on each side of a slice: finds thinner occluders.
        steps: u32 = 6 in 1..=64,
        /// The radius of the search, as a factor on the AO radius: makes up for the attenuation.
        radius_scale: f32 = 1.4 in 0.1..=4.0,
        /// How much occluders fade with their squared distance: 1 fades them out at the radius of the search, 0 turns it off.
        attenuation: f32 = 0.8 in 0.0..=1.0,
        /// Occluders lower than so many degrees above the tangent plane do not count: hides coarse meshes.
        angle_bias: f32 = 3.0 in 0.0..=60.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 2.0 in 1.0..=4.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl AgtaoParams {
    pub(crate) fn spacing(&self) -> Spacing {
        Spacing::new(self.steps, self.distribution)
    }
}

/// Attenuated GTAO of one frame.
pub(crate) struct Agtao<'a> {
    screen: &'a Screen<'a>,
    params: AgtaoParams,
    /// Of the search, squared (square world units).
    squared_radius: f32,
    /// Of the angle bias.
    cos_sin_bias: [f32; 2],
    /// From slice to slice.
    cos_sin_turn: [f32; 2],
    spacing: Spacing,
}

/// The highest occluder so far on one side of a slice.
struct Horizon<S: Simd, const N: usize> {
    /// 1 along the slice, -1 against it.
    sign: f32,
    /// Of the angle to the viewer.
    cosine: F<S>,
    /// Light between the viewer and it. See [`Slice::beam_above`].
    beam: [F<S>; N],
}

impl<S: Simd, const N: usize> Horizon<S, N> {
    #[inline(always)]
    fn new(slice: &Slice<S>, sign: f32, cosine: F<S>) -> Self {
        Self { sign, cosine, beam: slice.beam_above(cosine, sign) }
    }
}

impl<'a> Agtao<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: AgtaoParams) -> Self {
        let (sin, cos) = params.angle_bias.to_radians().sin_cos();
        let radius = screen.radius * params.radius_scale;
        let (turn_sin, turn_cos) = (PI / params.slices as f32).sin_cos();
        Self {
            screen,
            params,
            squared_radius: radius * radius,
            cos_sin_bias: [cos, sin],
            cos_sin_turn: [turn_cos, turn_sin],
            spacing: params.spacing(),
        }
    }

    /// Light that occluders on both sides of a slice take.
    #[inline(always)]
    fn lost<S: Simd, const N: usize>(&self, p: &Pixels<S>, slice: &Slice<S>, jitter: F<S>) -> [F<S>; N] {
        // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
        let [cos_bias, sin_bias] = self.cos_sin_bias;
        let (across, up) = (slice.sin_n * cos_bias, slice.cos_n.max(0.0) * sin_bias);
        let mut ahead = Horizon::new(slice, 1.0, up - across);
        let mut behind = Horizon::new(slice, -1.0, up + across);
        let mut lost = [F::new(up.simd(), 0.0); N];
        let reach = p.radius_px * self.params.radius_scale;
        for (k, share) in self.spacing.steps().iter().enumerate() {
            let pixels = (share.at(jitter) * reach).max(1.0 + k as f32);
            let stride = Stride::new(self.screen, slice, pixels);
            self.rise(p, slice, &stride, &mut ahead, &mut lost);
            self.rise(p, slice, &stride.reversed(), &mut behind, &mut lost);
        }
        lost
    }

    /// Adds the light that is lost where the horizon rises to a tap.
    #[inline(always)]
    fn rise<S: Simd, const N: usize>(
        &self,
        p: &Pixels<S>,
        slice: &Slice<S>,
        stride: &Stride<S>,
        horizon: &mut Horizon<S, N>,
        lost: &mut [F<S>; N],
    ) {
        let at = stride.look(self.screen, p);
        let cosine = at.towards * at.squared.rough_inverse_sqrt();
        let rises = at.squared.le(self.squared_radius) & horizon.cosine.lt(cosine);
        if !rises.any() {
            return;
        }
        let rises = rises & stride.inside(self.screen, p);
        let weight = 1.0 - at.squared * (self.params.attenuation / self.squared_radius);
        let beam = slice.beam_above::<N>(cosine, horizon.sign);
        for c in 0..N {
            lost[c] += rises.select((horizon.beam[c] - beam[c]) * weight, 0.0);
            horizon.beam[c] = rises.select(beam[c], horizon.beam[c]);
        }
        horizon.cosine = rises.select(cosine, horizon.cosine);
    }

    /// Sums over the slices of the pixels from (`x`, `y`) on.
    #[inline(always)]
    fn sums<S: Simd, const N: usize>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> Sums<S, N> {
        let simd = p.x.simd();
        let [turn, jitter] = noise_at(simd, x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let mut sums = Sums::new(simd);
        let mut direction = (turn * (PI * inverse)).cos_sin_of_half_turn();
        for s in 0..self.params.slices {
            let slice = Slice::towards(p, direction);
            let jitter = (jitter + s as f32 * 0.618_034).fract();
            sums.add(p, &slice, self.lost(p, &slice, jitter));
            direction = turned(direction, self.cos_sin_turn);
        }
        sums
    }
}

impl PixelMethod for Agtao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> F<S> {
        self.sums::<S, 1>(p, at).visibility(self.params.power)
    }
}

impl PixelShares<BENT_PLANES> for Agtao<'_> {
    #[inline(always)]
    fn shares<S: Simd>(&self, p: &Pixels<S>, at: (usize, usize)) -> [F<S>; BENT_PLANES] {
        self.sums::<S, BEAM>(p, at).planes(p, self.params.slices, self.params.power)
    }
}

/// A direction after a turn with a cosine and a sine.
#[inline(always)]
fn turned<S: Simd>((x, y): (F<S>, F<S>), [cos, sin]: [f32; 2]) -> (F<S>, F<S>) {
    (x.mul_add(cos, y * -sin), y.mul_add(cos, x * sin))
}
