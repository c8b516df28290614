//! A plane through a pixel and the camera, in which the methods with horizons look for occluders.

use super::screen::{Pixels, Tap};
use crate::simd::Simd;
use crate::simd::lanes::F;
use crate::simd::vector::V3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Least cosine between normal and view that the tangent plane is followed at. guess
pub(crate) const MOST_GRAZING: f32 = 0.1;

/// A slice of every pixel, spanned by the unit vectors `to_viewer` and one across it, "along".
// Jimenez et al. 2016, §4, Alg. 1: the light of a pixel as an integral over slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slice<S: Simd> {
    /// Direction on the screen, y up.
    pub(crate) dx: F<S>,
    pub(crate) dy: F<S>,
    /// How far a vector goes along, and towards the viewer once it is moved into the slice.
    pub(crate) along: V3<S>,
    pub(crate) towards: V3<S>,
    /// Length of the normal's projection into the slice.
    pub(crate) normal_length: F<S>,
    /// The projection's angle from `to_viewer`, positive along: cosine, sine and angle (rad).
    pub(crate) cos_n: F<S>,
    pub(crate) sin_n: F<S>,
    pub(crate) n: F<S>,
}

/// Where an occluder is in a slice, seen from the pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InSlice<S: Simd> {
    /// Towards the viewer, and along (world units).
    pub(crate) towards: F<S>,
    pub(crate) along: F<S>,
    /// Its distance, squared, and one over it.
    pub(crate) squared: F<S>,
    pub(crate) inverse_distance: F<S>,
}

impl<S: Simd> Slice<S> {
    /// The slice at `turn` half turns from the screen's x axis, in [0, 1].
    #[inline(always)]
    pub(crate) fn new(p: &Pixels<S>, turn: F<S>) -> Self {
        Self::towards(p, (turn * PI).cos_sin_of_half_turn())
    }

    /// The slice in a direction on the screen, a unit vector with y up.
    #[inline(always)]
    pub(crate) fn towards(p: &Pixels<S>, (dx, dy): (F<S>, F<S>)) -> Self {
        let v = p.to_viewer;
        let view_slope = dx.mul_add(v.x, dy * v.y);
        let inverse_along = (1.0 - view_slope * view_slope).max(1e-6).inverse_sqrt();
        let direction = V3 { x: dx, y: dy, z: F::new(dx.simd(), 0.0) };
        let along = v.mul_add(-view_slope, direction) * inverse_along;
        // (direction, 0) x v
        let axis = V3 { x: dy * v.z, y: -(dx * v.z), z: dx * v.y - dy * v.x } * inverse_along;
        let facing = p.normal.dot(v);
        // How far to go towards the viewer for a step along `axis` on the tangent plane.
        let slide = p.normal.dot(axis) * (1.0 / facing.max(MOST_GRAZING));
        let leaning = p.normal.dot(along);
        let squared = facing.mul_add(facing, leaning * leaning).max(1e-12);
        let inverse_length = squared.inverse_sqrt();
        let (cos_n, sin_n) = (facing * inverse_length, leaning * inverse_length);
        Self {
            dx,
            dy,
            along,
            towards: axis.mul_add(slide, v),
            normal_length: squared * inverse_length,
            cos_n,
            sin_n,
            n: cos_n.acos().with_sign_of(sin_n),
        }
    }

    /// The place on the screen so many pixels, by their height, along.
    #[inline(always)]
    pub(crate) fn place(&self, p: &Pixels<S>, pixels: F<S>) -> (F<S>, F<S>) {
        ((self.dx * p.inverse_aspect).mul_add(pixels, p.x), (-self.dy).mul_add(pixels, p.y))
    }

    /// Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
    #[inline(always)]
    pub(crate) fn project(&self, p: &Pixels<S>, tap: &Tap<S>) -> InSlice<S> {
        let t = tap.position - p.position;
        let (towards, along) = (t.dot(self.towards), t.dot(self.along));
        let squared = towards.mul_add(towards, along * along).max(1e-36);
        InSlice { towards, along, squared, inverse_distance: squared.inverse_sqrt() }
    }

    /// Light from the angles between the viewer and `angle` (with its cosine and sine), whose sign tells the side,
    /// weighted by the cosine to the projected normal and by the slice's share of the sphere.
    // Jimenez et al. 2016, Eq. 7: an antiderivative of cos(t - n) |sin t|, zero at the viewer.
    #[inline(always)]
    pub(crate) fn arc(&self, angle: F<S>, [cos, sin]: [F<S>; 2]) -> F<S> {
        let (cos_2, sin_2) = ((2.0 * cos).mul_add(cos, -1.0), 2.0 * cos * sin);
        let of_double = cos_2.mul_add(self.cos_n, sin_2 * self.sin_n);
        ((2.0 * angle).mul_add(self.sin_n, self.cos_n) - of_double) * 0.25
    }

    /// Light between the viewer and a horizon on one side, by the cosine between the two.
    #[inline(always)]
    pub(crate) fn light_above(&self, cosine: F<S>, sign: f32) -> F<S> {
        // The same as of `arc`: half of sin² t cos n plus or minus (t - sin t cos t) sin n.
        let (up, across) = (self.cos_n * 0.5, self.sin_n * (0.5 * sign));
        let square = (-cosine).mul_add(cosine, 1.0);
        square.mul_add(up, strip(cosine).mul_add(-across, across * FRAC_PI_2))
    }

    /// Light between the viewer and a horizon on one side; for N = 3 its vector as well, the integral of direction times light:
    /// towards the viewer, and along.
    // With t from the viewer and n turned by the sign, the integrals of cos t and sin t times cos(t - n) sin t, from 0 on. XeGTAO
    // 1.30 has the same for both sides at once.
    #[inline(always)]
    pub(crate) fn beam_above<const N: usize>(&self, cosine: F<S>, sign: f32) -> [F<S>; N] {
        let mut beam = [self.light_above(cosine, sign); N];
        if N == 3 {
            let square = (-cosine).mul_add(cosine, 1.0).max(0.0);
            let (sine_cubed, cubed) = (square * square.sqrt(), cosine * cosine * cosine);
            let (up, across) = (self.cos_n * (1.0 / 3.0), self.sin_n * (1.0 / 3.0));
            beam[1] = up.mul_add(1.0 - cubed, across * sine_cubed * sign);
            beam[2] = across.mul_add(cosine.mul_add(-3.0, cubed + 2.0), up * sine_cubed * sign);
        }
        beam
    }

    /// Light of the whole slice when nothing occludes: cos n + n sin n, off by less than 1e-5.
    #[inline(always)]
    pub(crate) fn open(&self) -> F<S> {
        // Minimax in the cosine, which few normals have below the range's end: they face away.
        const SERIES: [f32; 7] = [
            1.570_803_4,
            -6.300_397e-5,
            -0.786_075_3,
            0.336_573_45,
            -0.192_053_03,
            0.094_723_98,
            -0.023_917_738,
        ];
        self.cos_n.max(-0.25).polynomial(SERIES)
    }
}

/// Area of the unit disk between a diameter and a chord at a distance x from it, in [-1, 1] and with its sign:
/// asin x + x sqrt(1 - x²). Off by less than 2e-4.
#[inline(always)]
pub(crate) fn strip<S: Simd>(x: F<S>) -> F<S> {
    // Minimax of what is left beyond the chord, over (1 - x) to the power of 3/2, which is smooth.
    const SERIES: [f32; 4] = [1.570_801_7, 0.355_869_5, -0.051_884_5, 0.011_219_9];
    let distance = x.abs();
    let left = (1.0 - distance).max(1e-30);
    let beyond = left * left * left.rough_inverse_sqrt() * distance.polynomial(SERIES);
    (FRAC_PI_2 - beyond).with_sign_of(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Isa, Kernel, Level, MAX_LANES, Simd};

    struct Check;

    impl Kernel for Check {
        fn run<S: Simd>(self, simd: S) {
            for block in 0..=1000 {
                let values: [f32; MAX_LANES] =
                    std::array::from_fn(|i| (-1.0 + block as f32 / 500.0 + i as f32 * 1e-3).min(1.0));
                let areas = strip(F::load(simd, &values)).array();
                for (x, area) in values.into_iter().zip(areas) {
                    assert!((area - (x.asin() + x * (1.0 - x * x).sqrt())).abs() < 2e-4, "{x}");
                }
            }
        }
    }

    #[test]
    fn strips_are_as_exact_as_they_say() {
        Level::available().for_each(|level| Isa::new(level).unwrap().run(Check));
    }

    /// A slice whose projected normal leans by `n` (rad).
    fn slice<S: Simd>(simd: S, n: f32) -> Slice<S> {
        let of = |value| F::new(simd, value);
        let zero = V3::new(simd, [0.0; 3]);
        Slice {
            dx: of(1.0),
            dy: of(0.0),
            along: zero,
            towards: zero,
            normal_length: of(1.0),
            cos_n: of(n.cos()),
            sin_n: of(n.sin()),
            n: of(n),
        }
    }

    struct Beams;

    impl Kernel for Beams {
        fn run<S: Simd>(self, simd: S) {
            for (n, end, sign) in
                [(0.0f32, 1.2f32, 1.0f32), (0.7, 1.9, 1.0), (0.7, 0.6, -1.0), (-1.1, 0.4, 1.0)]
            {
                // Sums over thin arcs of direction times cos(t - n) sin t.
                let thin = |i: i32| (f64::from(i) + 0.5) * f64::from(end) / 1e4;
                let light = |t: f64| (t - f64::from(sign * n)).cos() * t.sin() * f64::from(end) / 1e4;
                let sum = |of: fn(f64) -> f64| (0..10_000).map(|i| of(thin(i)) * light(thin(i))).sum::<f64>();
                let expected = [sum(|_| 1.0), sum(f64::cos), f64::from(sign) * sum(f64::sin)];
                let found = slice(simd, n).beam_above::<3>(F::new(simd, end.cos()), sign);
                for (found, expected) in found.iter().zip(expected) {
                    // The light is that of `strip`.
                    let off = (f64::from(found.array()[0]) - expected).abs();
                    assert!(off < 2e-4, "{n} {end} {sign}: {found:?}, expected {expected}");
                }
            }
        }
    }

    #[test]
    fn the_vector_of_a_slice_is_its_integral() {
        Level::available().for_each(|level| Isa::new(level).unwrap().run(Beams));
    }
}
