//! HBAO: how far the horizon rises above the tangent plane, direction by direction.
// Bavoil, Sainz, Dimitrov 2008, Image-Space Horizon-Based Ambient Occlusion: the sine of the horizon's angle minus that
// of the tangent, with an angle bias and an attenuation 1 - (r/R)². Where ours differs: directions come in opposite
// pairs (a slice through the viewer), angles are measured from the viewer's plane of every pixel instead of the image
// plane's, and the noise is 5x5 instead of 4x4.

use super::PixelMethod;
use super::gtao::{power, taper};
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use super::slice::Slice;
use crate::simd::Simd;
use crate::simd::lanes::F;

filtered_params! {
    /// Parameters of HBAO.
    HbaoParams {
        /// Pairs of opposite directions a pixel: less noise.
        slices: u32 = 3 in 1..=64,
        /// Taps in each direction: finds thinner occluders.
        steps: u32 = 6 in 1..=64,
        /// The radius of the search, as a factor on the AO radius.
        radius_scale: f32 = 1.0 in 0.1..=4.0,
        /// Occluders lower than so many degrees above the tangent plane do not count: hides coarse meshes.
        angle_bias: f32 = 30.0 in 0.0..=60.0,
        /// How much occluders fade with their squared distance: 1 fades them out at the radius, 0 turns it off.
        attenuation: f32 = 1.0 in 0.0..=1.0,
        /// Exponent of the taps' spacing: above 1, more of them lie near the pixel.
        distribution: f32 = 1.0 in 1.0..=4.0,
        /// Factor on the occlusion.
        strength: f32 = 1.0 in 0.1..=4.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

/// HBAO of one frame.
pub(crate) struct Hbao<'a> {
    screen: &'a Screen<'a>,
    params: HbaoParams,
    /// Of the angle bias.
    cos_sin_bias: [f32; 2],
}

impl<'a> Hbao<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, params: HbaoParams) -> Self {
        let (sin, cos) = params.angle_bias.to_radians().sin_cos();
        Self { screen, params, cos_sin_bias: [cos, sin] }
    }

    /// Occlusion on both sides of a slice.
    #[inline(always)]
    fn occlusion<S: Simd>(&self, p: &Pixels<S>, slice: &Slice<S>, jitter: F<S>) -> F<S> {
        // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
        let [cos_bias, sin_bias] = self.cos_sin_bias;
        let (across, up) = (slice.sin_n * cos_bias, slice.cos_n.max(0.0) * sin_bias);
        let (mut right, mut left) = (up - across, up + across);
        let mut occlusion = F::new(up.simd(), 0.0);
        let reach = p.radius_px * self.params.radius_scale;
        for k in 0..self.params.steps {
            let share =
                taper((jitter + k as f32) * (1.0 / self.params.steps as f32), self.params.distribution);
            let pixels = (share * reach).max(1.0 + k as f32);
            occlusion += self.rise(p, slice, pixels, &mut right);
            occlusion += self.rise(p, slice, -pixels, &mut left);
        }
        occlusion
    }

    /// What the horizon's rise to a tap adds to the occlusion.
    #[inline(always)]
    fn rise<S: Simd>(&self, p: &Pixels<S>, slice: &Slice<S>, pixels: F<S>, highest: &mut F<S>) -> F<S> {
        let radius = self.screen.radius * self.params.radius_scale;
        let tap = self.screen.tap(slice.place(p, pixels));
        let at = slice.project(p, &tap);
        let sine = at.towards * at.inverse_distance;
        let rises = tap.inside & at.squared.le(radius * radius) & highest.lt(sine);
        let weight = 1.0 - at.squared * (self.params.attenuation / (radius * radius));
        let rise = rises.select((sine - *highest) * weight, 0.0);
        *highest = rises.select(sine, *highest);
        rise
    }
}

impl PixelMethod for Hbao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let simd = p.x.simd();
        let [turn, jitter] = noise_at(simd, x, y);
        let inverse = 1.0 / self.params.slices as f32;
        let mut occlusion = F::new(simd, 0.0);
        for s in 0..self.params.slices {
            let slice = Slice::new(p, (turn + s as f32) * inverse);
            occlusion += self.occlusion(p, &slice, (jitter + s as f32 * 0.618_034).fract());
        }
        power((1.0 - occlusion * (0.5 * inverse * self.params.strength)).saturate(), self.params.power)
    }
}
