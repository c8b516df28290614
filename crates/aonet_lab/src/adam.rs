//! Adam's arithmetic for one weight, and the learning rate's schedule.

/// A step of Adam. Kingma and Ba 2015, Algorithm 1, with its constants.
pub(crate) struct Adam {
    /// Corrections of the moments' bias, which start at zero.
    bias: (f64, f64),
}

impl Adam {
    const BETA1: f64 = 0.9;
    const BETA2: f64 = 0.999;
    const EPSILON: f64 = 1e-8;

    pub(crate) fn at(step: u64) -> Self {
        let power = step.min(i32::MAX as u64) as i32;
        Self { bias: (1.0 - Self::BETA1.powi(power), 1.0 - Self::BETA2.powi(power)) }
    }

    pub(crate) fn change(&self, [mean, square]: [&mut f32; 2], g: f64) -> f64 {
        *mean = (Self::BETA1 * f64::from(*mean) + (1.0 - Self::BETA1) * g) as f32;
        *square = (Self::BETA2 * f64::from(*square) + (1.0 - Self::BETA2) * g * g) as f32;
        f64::from(*mean) / self.bias.0 / ((f64::from(*square) / self.bias.1).sqrt() + Self::EPSILON)
    }
}

/// Half a cosine from `initial` at step 0 to zero at `steps`.
pub(crate) fn cosine_decay(initial: f64, step: u64, steps: u64) -> f64 {
    0.5 * initial * (1.0 + (std::f64::consts::PI * step as f64 / steps as f64).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_decays_from_the_initial_to_zero() {
        assert_eq!(cosine_decay(1e-3, 0, 100), 1e-3);
        assert!((cosine_decay(1e-3, 50, 100) - 5e-4).abs() < 1e-12);
        assert!(cosine_decay(1e-3, 100, 100) < 1e-18);
    }
}
