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
    pub(crate) fn near(function: impl Fn(f64) -> f64) -> Self {
        Self::meeting(function, std::array::from_fn(chebyshev))
    }

    /// The same with the places moved to between `from` and 1; the last of them is 1.
    fn near_from(from: f64, function: impl Fn(f64) -> f64) -> Self {
        Self::meeting(function, std::array::from_fn(|i| from + (1.0 - from) * chebyshev(i) / chebyshev(3)))
    }

    /// The one that meets a function in these places.
    // Newton's divided differences.
    fn meeting(function: impl Fn(f64) -> f64, places: [f64; 4]) -> Self {
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

/// A root of the Chebyshev polynomial of degree 4 on [0, 1], in ascending order.
fn chebyshev(i: usize) -> f64 {
    0.5 - 0.5 * ((2 * i + 1) as f64 * PI / 8.0).cos()
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
    /// To an exponent below 2. Cubics do not come near these powers, which are steep or bent at 0.
    Low(f32),
    /// Any other.
    High(Squared),
}

/// A power of numbers in [0, 1], exact at 1: a cubic near the power to an exponent in [1.6, 3.2), squared so many times. Off by less than
/// 2.1e-3 up to the exponent 3.2, and by less than 5e-4 above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Squared {
    cubic: Cubic,
    times: u32,
}

impl Power {
    pub(crate) fn new(exponent: f32) -> Self {
        if exponent < 2.0 {
            return Self::Low(exponent);
        }
        let (mut exponent, mut times) = (f64::from(exponent), 0);
        while exponent >= 3.2 {
            (exponent, times) = (0.5 * exponent, times + 1);
        }
        // The more often it is squared, the less its low values matter, and the more those near 1 do.
        let from = 1.0 - 0.75_f64.powf(f64::from(times));
        Self::High(Squared { cubic: Cubic::near_from(from, |x| x.powf(exponent)), times })
    }
}

/// Replaces numbers by their powers.
pub(crate) trait Raise: Copy {
    fn raise<S: Simd, const N: usize>(self, numbers: &mut [F<S>; N]);
}

/// An exponent.
impl Raise for f32 {
    #[inline(always)]
    fn raise<S: Simd, const N: usize>(self, numbers: &mut [F<S>; N]) {
        for x in numbers {
            *x = power(*x, self);
        }
    }
}

impl Raise for Squared {
    #[inline(always)]
    fn raise<S: Simd, const N: usize>(self, numbers: &mut [F<S>; N]) {
        for x in numbers.iter_mut() {
            *x = self.cubic.at(*x);
        }
        for _ in 0..self.times {
            for x in numbers.iter_mut() {
                *x *= *x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    fn worst(function: impl Fn(f32) -> f32, near: impl Fn(F<Portable>) -> F<Portable>) -> f32 {
        let off = |x: f32| (near(F::new(Portable, x)).array()[3] - function(x)).abs();
        (0..=1000).map(|i| off(i as f32 / 1000.0)).fold(0.0, f32::max)
    }

    fn power_of(exponent: f32, x: F<Portable>) -> F<Portable> {
        let mut numbers = [x];
        match Power::new(exponent) {
            Power::Low(exponent) => exponent.raise(&mut numbers),
            Power::High(power) => power.raise(&mut numbers),
        }
        numbers[0]
    }

    #[test]
    fn a_cubic_is_met_exactly_and_a_power_nearly() {
        let cubic = Cubic::near(|x| 3.0 - x + 0.5 * x * x + 2.0 * x * x * x);
        assert!(worst(|x| 3.0 - x + 0.5 * x * x + 2.0 * x * x * x, |x| cubic.at(x)) < 1e-6);
        for (exponent, bound) in [
            (0.0, 1e-6),
            (0.5, 1e-4),
            (2.0, 1e-6),
            (2.4, 2e-3),
            (5.945, 5e-4),
            (6.39, 5e-4),
            (11.3, 5e-4),
            (51.19, 5e-4),
            (64.0, 5e-4),
        ] {
            let off = worst(|x| x.powf(exponent), |x| power_of(exponent, x));
            assert!(off < bound, "{exponent}: {off}");
            if exponent >= 2.0 {
                assert!((power_of(exponent, F::new(Portable, 1.0)).array()[0] - 1.0).abs() < 1e-5);
            }
        }
        assert!(worst(|x| x.powf(5.945), |x| power_of(5.845, x)) > 1e-3);
    }
}
