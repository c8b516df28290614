//! SSAO: points around the pixel that are behind what the depth buffer shows count as occluded.
// Mittring 2007, Finding Next Gen: CryEngine 2, §8.5.4.3: points in a sphere. With `hemisphere`, points about the normal,
// as the technique is usually written today (Shanmugam and Arikan 2007 took the normal in first). Where ours differs:
// the points are a low-discrepancy set turned by 5x5 noise instead of a 4x4 texture, the filter is edge-aware, and the
// sphere's visibility is doubled, so that an open wall, half of whose sphere is inside it, is 1.

use super::PixelMethod;
use super::gtao::power;
use super::hemisphere::{Basis, directions, look, on_screen, van_der_corput};
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use crate::simd::Simd;
use crate::simd::lanes::F;

filtered_params! {
    /// Parameters of SSAO.
    SsaoParams {
        /// Points a pixel: less noise.
        samples: u32 = 16 in 1..=256,
        /// 1: points in the normal's hemisphere. 0: in the whole sphere, without normals.
        hemisphere: u32 = 1 in 0..=1,
        /// The radius of the search, as a factor on the AO radius.
        radius_scale: f32 = 1.0 in 0.1..=4.0,
        /// How far in front of a point the surface must be to hide it (share of the AO radius): hides the stairs of the
        /// depth buffer.
        bias: f32 = 0.025 in 0.0..=0.5,
        /// Occluders that are farther in front of the pixel than this fade out (share of the AO radius).
        range: f32 = 1.0 in 0.1..=10.0,
        /// Exponent of the points' distances: above 1, more of them lie near the pixel.
        distribution: f32 = 2.0 in 0.33..=4.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl SsaoParams {
    /// Sample points in the unit ball.
    pub(crate) fn points(&self) -> Vec<[f32; 3]> {
        let mut points = directions(self.samples, false);
        for (i, point) in points.iter_mut().enumerate() {
            let distance = van_der_corput(i as u32).powf(self.distribution);
            *point = point.map(|c| c * distance);
            if self.hemisphere == 0 && i % 2 == 1 {
                *point = point.map(|c| -c);
            }
        }
        points
    }
}

/// SSAO of one frame.
pub(crate) struct Ssao<'a> {
    screen: &'a Screen<'a>,
    params: SsaoParams,
    /// Sample points in the unit ball.
    points: &'a [[f32; 3]],
}

impl<'a> Ssao<'a> {
    /// `points` are [`SsaoParams::points`].
    pub(crate) fn new(screen: &'a Screen<'a>, params: SsaoParams, points: &'a [[f32; 3]]) -> Self {
        Self { screen, params, points }
    }
}

impl PixelMethod for Ssao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let [turn, _] = noise_at(p.x.simd(), x, y);
        let unit = self.screen.radius;
        let sphere = self.params.hemisphere == 0;
        let basis = Basis::about(if sphere { p.to_viewer } else { p.normal }, turn);
        let mut hidden = F::new(turn.simd(), 0.0);
        for point in self.points {
            let sample = basis.to_view(*point).mul_add(unit * self.params.radius_scale, p.position);
            let (tap, in_front) = look(self.screen, sample);
            let before_pixel = (tap.position.z - p.position.z).abs().max(1e-20);
            let near = (unit * self.params.range / before_pixel).min(1.0);
            // Hermite, as shaders have it.
            let weight = near * near * (3.0 - 2.0 * near);
            let counts = on_screen(p, sample, &tap) & !in_front.le(unit * self.params.bias);
            hidden += counts.select(weight, 0.0);
        }
        let visibility = 1.0 - hidden * (1.0 / self.points.len() as f32);
        power((visibility * if sphere { 2.0 } else { 1.0 }).saturate(), self.params.power)
    }
}
