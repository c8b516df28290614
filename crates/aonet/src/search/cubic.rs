//! Cubics in place of powers, which cost ten times as much.

use super::gtao::power;
use crate::simd::Simd;
use crate::simd::lanes::F;
use std::f64::consts::PI;

/// `c0` + `c1` x + `c2` x² + `c3` x³ for x in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cubic([f32; 4]);

impl Cubic {
    /// The constant 0.
    const ZERO: Self = Self([0.0; 4]);

    /// The one that meets a function in four places, the roots of a Chebyshev polynomial: nearly as close as one can be.
    // Newton's divided differences.
    pub(crate) fn near(function: impl Fn(f64) -> f64) -> Self {
        let places: [f64; 4] = std::array::from_fn(|i| 0.5 - 0.5 * ((2 * i + 1) as f64 * PI / 8.0).cos());
        let mut differences = places.map(function);
        for order in 1..4 {
            for i in (order..4).rev() {
                differences[i] = (differences[i] - differences[i - 1]) / (places[i] - places[i - order]);
            }
        }
        let mut coefficients = [0.0; 4];
        for i in (0..4).rev() {
            // Times (x - place), plus the difference.
            for c in (1..4).rev() {
                coefficients[c] = coefficients[c - 1] - coefficients[c] * places[i];
            }
            coefficients[0] = differences[i] - coefficients[0] * places[i];
        }
        Self(coefficients.map(|c| c as f32))
    }

    /// From the constant on.
    pub(crate) fn coefficients(self) -> [f32; 4] {
        self.0
    }

    #[inline(always)]
    pub(crate) fn at<S: Simd>(self, x: F<S>) -> F<S> {
        x.polynomial(self.0)
    }
}

/// Taps on each side of a slice at most.
const MOST_STEPS: usize = 64;

/// Distances of the taps on a side of a slice from its pixel, as shares of the search's radius: for each step a cubic of
/// the jitter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spacing {
    cubics: [Cubic; MOST_STEPS],
    steps: usize,
}

impl Spacing {
    /// ((step + jitter) / steps) to the power of `exponent`: above 1, more taps lie near the pixel.
    pub(crate) fn new(steps: u32, exponent: f32) -> Self {
        let (of, exponent, steps) = (f64::from(steps), f64::from(exponent), steps as usize);
        let mut cubics = [Cubic::ZERO; MOST_STEPS];
        for (step, cubic) in cubics[..steps].iter_mut().enumerate() {
            *cubic = Cubic::near(|jitter| ((jitter + step as f64) / of).powf(exponent));
        }
        Self { cubics, steps }
    }

    /// Step by step, outwards.
    pub(crate) fn steps(&self) -> &[Cubic] {
        &self.cubics[..self.steps]
    }
}

/// A power of numbers in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Power {
    /// To any exponent.
    Any(f32),
    /// A whole power times a cubic near the rest, an exponent in [2, 3): off by less than 2e-3 if there is no whole one.
    Smooth(u32, Cubic),
}

impl Power {
    /// Cubics do not come near lower powers, which are steep or bent at 0.
    pub(crate) fn new(exponent: f32) -> Self {
        if exponent < 2.0 {
            return Self::Any(exponent);
        }
        let whole = exponent as u32 - 2;
        Self::Smooth(whole, Cubic::near(|x| x.powf(f64::from(exponent) - f64::from(whole))))
    }

    #[inline(always)]
    pub(crate) fn of<S: Simd>(self, x: F<S>) -> F<S> {
        match self {
            Self::Any(exponent) => power(x, exponent),
            Self::Smooth(mut whole, rest) => {
                let (mut product, mut factor) = (rest.at(x), x);
                while whole > 0 {
                    if whole & 1 == 1 {
                        product *= factor;
                    }
                    factor *= factor;
                    whole >>= 1;
                }
                product
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    fn worst(function: impl Fn(f32) -> f32, near: impl Fn(F<Portable>) -> F<Portable>) -> f32 {
        let off = |x: f32| (near(F::new(Portable::<4>, x)).array()[3] - function(x)).abs();
        (0..=1000).map(|i| off(i as f32 / 1000.0)).fold(0.0, f32::max)
    }

    #[test]
    fn a_cubic_is_met_exactly_and_a_power_nearly() {
        let cubic = Cubic::near(|x| 3.0 - x + 0.5 * x * x + 2.0 * x * x * x);
        assert!(worst(|x| 3.0 - x + 0.5 * x * x + 2.0 * x * x * x, |x| cubic.at(x)) < 1e-6);
        for (exponent, bound) in
            [(0.0, 1e-6), (0.5, 1e-4), (2.0, 1e-6), (2.4, 2e-3), (5.945, 1e-3), (64.0, 1e-3)]
        {
            let off = worst(|x| x.powf(exponent), |x| Power::new(exponent).of(x));
            assert!(off < bound, "{exponent}: {off}");
        }
        assert!(worst(|x| x.powf(5.945), |x| Power::new(5.845).of(x)) > 1e-3);
    }
}
