//! NNAO: a tiny network for every pixel, whose first layer is a filter sampled on a spiral.
// Holden, Saito, Komura 2016, Neural Network Ambient Occlusion, and the shader published with it. Where ours differs: the
// spiral has one of 64 rotations instead of any, the filter is trained at the taps that it is used at, without dropout,
// and outside of the frame a tap is skipped. The weights are our own.

use super::PixelMethod;
use super::gtao::power;
use super::nnao_taps::{INPUTS, NnaoParams, Spiral};
use super::nnao_weights::{HIDDEN, NnaoWeights, Standard, Unit};
use super::noise::{COLUMNS, SIDE, noise_row};
use super::screen::{Pixels, Screen};
use crate::simd::lanes::F;
use crate::simd::{MAX_LANES, Simd};

/// Rotations of the spiral.
const ROTATIONS: usize = 64;
/// Longest vectors in a row of the noise's tile.
const BLOCKS: usize = COLUMNS / MAX_LANES;

/// A tap of as many neighbouring pixels as the longest vector has lanes: its place by axis, and its filter by weight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Taps {
    place: [[f32; MAX_LANES]; 2],
    filter: [[f32; MAX_LANES]; INPUTS * HIDDEN],
}

impl Taps {
    /// All taps of such pixels, then those of their neighbours, through the rows of the noise's tile.
    pub(crate) fn all(params: &NnaoParams, weights: &NnaoWeights) -> Vec<Self> {
        let tap = |r: usize, i: u32| {
            let place = Spiral { params, rotation: r as f32 / ROTATIONS as f32 }.place(i);
            (place, weights.filter_at(place))
        };
        let samples = params.samples as usize;
        let spirals: Vec<_> = (0..ROTATIONS)
            .flat_map(|r| (0..params.samples).map(move |i| (r, i)))
            .map(|(r, i)| tap(r, i))
            .collect();
        let none = Self { place: Default::default(), filter: Default::default() };
        let mut taps = vec![none; BLOCKS * SIDE * samples];
        for (block, taps) in taps.chunks_mut(samples).enumerate() {
            let turns = &noise_row(block / BLOCKS)[block % BLOCKS * MAX_LANES..];
            for lane in 0..MAX_LANES {
                let rotation = (turns[lane] * ROTATIONS as f32) as usize % ROTATIONS;
                for (to, (place, filter)) in taps.iter_mut().zip(&spirals[rotation * samples..]) {
                    to.place.iter_mut().zip(place).for_each(|(to, v)| to[lane] = *v);
                    to.filter.iter_mut().zip(filter).for_each(|(to, v)| to[lane] = *v);
                }
            }
        }
        taps
    }
}

/// NNAO of one frame.
pub(crate) struct Nnao<'a> {
    screen: &'a Screen<'a>,
    params: NnaoParams,
    weights: &'a NnaoWeights,
    taps: &'a [Taps],
}

impl<'a> Nnao<'a> {
    /// `taps` are [`Taps::all`] of the same parameters and weights.
    pub(crate) fn new(
        screen: &'a Screen<'a>,
        params: NnaoParams,
        weights: &'a NnaoWeights,
        taps: &'a [Taps],
    ) -> Self {
        Self { screen, params, weights, taps }
    }
}

impl PixelMethod for Nnao<'_> {
    #[inline(always)]
    fn visibility<S: Simd>(&self, p: &Pixels<S>, (x, y): (usize, usize)) -> F<S> {
        let simd = p.x.simd();
        let block = y % SIDE * BLOCKS + x / MAX_LANES % BLOCKS;
        let lane = x % MAX_LANES;
        let samples = self.params.samples as usize;
        let Standard { mean, scale } = self.weights.standard();
        let inverse_radius = 1.0 / self.screen.radius;
        let mut hidden = [F::new(simd, 0.0); HIDDEN];
        for (sum, bias) in hidden.iter_mut().zip(self.weights.hidden_bias()) {
            *sum = F::new(simd, bias);
        }
        for taps in &self.taps[block * samples..][..samples] {
            let (dx, dy) = (F::load(simd, &taps.place[0][lane..]), F::load(simd, &taps.place[1][lane..]));
            let tap = self
                .screen
                .tap(((dx * p.inverse_aspect).mul_add(p.radius_px, p.x), (-dy).mul_add(p.radius_px, p.y)));
            let away = tap.position - p.position;
            let near = (1.0 - away.dot(away).sqrt() * inverse_radius).saturate();
            let near = tap.inside.select(near, 0.0);
            let normal = self.screen.normal(tap.index) - p.normal;
            let inputs = [normal.x, normal.y, normal.z, away.z * inverse_radius];
            for c in 0..INPUTS {
                // Far away, as the background is, `near` is zero and the product must be too.
                let input = near * ((inputs[c].max(-1e6).min(1e6) - mean[c]) * scale[c]);
                for (h, sum) in hidden.iter_mut().enumerate() {
                    *sum = input.mul_add(F::load(simd, &taps.filter[c * HIDDEN + h][lane..]), *sum);
                }
            }
        }
        power((1.0 - self.weights.head(hidden)).saturate(), self.params.power)
    }
}

impl<S: Simd> Unit for F<S> {
    #[inline(always)]
    fn prelu(self, [below, above]: [f32; 2]) -> Self {
        self.max(0.0).mul_add(above, self.min(0.0) * below)
    }
}

#[cfg(test)]
mod tests {
    use super::super::nnao_taps::taps;
    use super::super::nnao_weights::COUNT;
    use super::super::noise::noise_at;
    use super::*;
    use crate::frame::ao_image::AoParams;
    use crate::frame::camera::{Camera, Projection};
    use crate::frame::gbuffer::GBuffer;
    use crate::frame::size::Size;
    use crate::simd::Portable;

    #[test]
    fn lanes_agree_with_one_pixel_at_a_time() {
        let size = (48, 20);
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(projection, Size::px(size.0, size.1)).unwrap();
        let depth = |i: usize| if i % 48 < 5 { f32::INFINITY } else { 3.0 + (i % 48) as f32 * 0.02 };
        let normals = (0..size.0 * size.1).map(|i| if i % 7 < 3 { [0.0, 0.0, 1.0] } else { [0.0, 0.6, 0.8] });
        let depths = (0..size.0 * size.1).map(depth).collect::<Vec<_>>();
        let frame = GBuffer::new(camera, depths, normals.collect::<Vec<_>>()).unwrap();
        let mut state = 1u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 24) as f32
        };
        let values = NnaoWeights::start(&mut unit);
        assert_eq!(values.len(), COUNT);
        let weights = NnaoWeights::new(values, [0.1, 0.0, -0.1, 0.2], [0.5, 1.0, 2.0, 0.7]).unwrap();
        assert_eq!(NnaoWeights::from_bytes(&weights.to_bytes().unwrap()).unwrap(), weights);
        let (params, ao) = (NnaoParams::default(), AoParams::new(0.8).unwrap());
        let screen = Screen::new(&frame, ao);
        let all = Taps::all(&params, &weights);
        let nnao = Nnao::new(&screen, params, &weights, &all);
        let (mut compared, mut spread) = (0, [1.0f32, 0.0]);
        for y in 0..size.1 {
            for x in (0..size.0).step_by(4) {
                let found = nnao.visibility(&screen.pixels(Portable, x, y), (x, y)).array();
                let turns = noise_at(Portable, x, y)[0].array();
                for i in (0..4).filter(|i| frame.is_foreground(y * size.0 + x + i)) {
                    let rotation = (turns[i] * ROTATIONS as f32).floor() / ROTATIONS as f32;
                    let spiral = Spiral { params: &params, rotation };
                    let seen = taps(&frame, ao, spiral, [x + i, y]);
                    let expected = (1.0 - weights.occlusion(&seen)).clamp(0.0, 1.0);
                    assert!((found[i] - expected).abs() < 1e-3, "({}, {y}): {} {expected}", x + i, found[i]);
                    compared += 1;
                    spread = [spread[0].min(expected), spread[1].max(expected)];
                }
            }
        }
        assert!(compared > 800 && spread[1] - spread[0] > 0.2, "{compared} {spread:?}");
    }

    #[test]
    fn broken_weights_are_refused() {
        let weights = NnaoWeights::new(vec![0.0; COUNT], [0.0; INPUTS], [1.0; INPUTS]).unwrap();
        let bytes = weights.to_bytes().unwrap();
        for end in (0..bytes.len()).step_by(997) {
            assert!(NnaoWeights::from_bytes(&bytes[..end]).is_err());
        }
        assert!(NnaoWeights::new(vec![0.0; 3], [0.0; INPUTS], [1.0; INPUTS]).is_err());
        assert!(NnaoWeights::new(vec![f32::NAN; COUNT], [0.0; INPUTS], [1.0; INPUTS]).is_err());
        assert!(NnaoWeights::new(vec![0.0; COUNT], [0.0; INPUTS], [0.0; INPUTS]).is_err());
    }
}
