//! The occlusion term of SSDO: hemisphere samples put back onto the depth buffer.
// Ritschel, Grosch, Seidel 2009, Approximating Dynamic Global Illumination in Image Space, §3.1: a sample at a random
// distance along a direction is occluded if it lies behind the surface that its pixel shows. Where ours differs: the
// directions are distributed by the cosine instead of being weighted by it, turned by 5x5 noise, and `depth_limit`
// takes back occluders that are too far in front, which the paper leaves to depth peeling.

use super::PixelMethod;
use super::gtao::power;
use super::hemisphere::{Basis, directions, look, on_screen, van_der_corput};
use super::noise::noise_at;
use super::params::filtered_params;
use super::screen::{Pixels, Screen};
use crate::simd::Simd;
use crate::simd::lanes::F;

filtered_params! {
    /// Parameters of SSDO's occlusion.
    SsdoParams {
        /// Samples a pixel: less noise.
        samples: u32 = 16 in 1..=256,
        /// The radius of the search, as a factor on the AO radius.
        radius_scale: f32 = 1.0 in 0.1..=4.0,
        /// How far in front of a sample the surface must be to hide it (share of the AO radius).
        bias: f32 = 0.01 in 0.0..=0.5,
        /// An occluder that is farther in front of its sample does not count (share of the AO radius).
        depth_limit: f32 = 2.0 in 0.05..=100.0,
        /// Exponent of the samples' distances: above 1, more of them lie near the pixel.
        distribution: f32 = 1.0 in 0.33..=4.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

impl SsdoParams {
    /// Directions about +z, and the place of each one's sample along it, in (0, 1).
    pub(crate) fn directions(&self) -> Vec<([f32; 3], f32)> {
        directions(self.samples, true).into_iter().zip((0..).map(van_der_corput)).collect()
    }
}

/// SSDO's occlusion of one frame.
pub(crate) struct Ssdo<'a> {
    screen: &'a Screen<'a>,
    params: SsdoParams,
    /// See [`SsdoParams::directions`].
    samples: &'a [([f32; 3], f32)],
}

impl<'a> Ssdo<'a> {
    /// `samples` are [`SsdoParams::directions`].
    pub(crate) fn new(screen: &'a Screen<'a>, params: SsdoParams, samples: &'a [([f32; 3], f32)]) -> Self {
        Self { screen, params, samples }
    }
}

impl PixelMethod for Ssdo<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let [turn, jitter] = noise_at(p.x.simd(), x, y);
        let unit = self.screen.radius;
        let basis = Basis::about(p.normal, turn);
        let mut hidden = F::new(turn.simd(), 0.0);
        for (direction, place) in self.samples {
            let distance = power((jitter + *place).fract(), self.params.distribution);
            let reach = distance * (unit * self.params.radius_scale);
            let sample = basis.to_view(*direction).mul_add(reach, p.position);
            let (tap, in_front) = look(self.screen, sample);
            let counts = on_screen(p, sample, &tap)
                & !in_front.le(unit * self.params.bias)
                & in_front.lt(unit * self.params.depth_limit);
            hidden += counts.select(1.0, 0.0);
        }
        power((1.0 - hidden * (1.0 / self.samples.len() as f32)).saturate(), self.params.power)
    }
}
