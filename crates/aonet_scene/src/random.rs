//! Random numbers that depend on a key only, not on the order of calls.

use aonet::internals::random::SplitMix64;
use glam::Vec3;

/// A stream with the distributions that datasets, training and tuning draw from.
#[derive(Debug, Clone)]
pub struct Random(SplitMix64);

impl Random {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// The stream of frame `index` of a scene, the same in every order and shard.
    pub fn of_frame(seed: u64, scene: &str, index: u32) -> Self {
        // FNV-1a with its published offset and prime; the separator keeps name and index apart.
        let bytes = seed.to_le_bytes().into_iter().chain(scene.bytes()).chain([0]).chain(index.to_le_bytes());
        Self::new(bytes.fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)))
    }

    /// The stream of a crop of a training step, so that a resumed run draws the same crops.
    pub fn of_crop(seed: u64, step: u64, index: u64) -> Self {
        [step, index].into_iter().fold(Self::new(seed), |mut random, key| Self::new(random.bits() ^ key))
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0.bits()
    }

    /// Uniform in [0, 1), to the last bit.
    pub fn unit_f64(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.0.unit()
    }

    /// Uniform in [`low`, `high`).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Normally distributed with mean 0 and variance 1.
    // Box and Muller 1958.
    pub fn normal(&mut self) -> f32 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f32::consts::TAU * self.unit()).cos()
    }

    /// Log-uniform between two positive bounds.
    pub fn log_range(&mut self, low: f32, high: f32) -> f32 {
        low * (high / low).powf(self.unit())
    }

    /// Uniform in 0..`n`; `n` > 0.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// Each axis uniform between the corners.
    pub fn within(&mut self, min: Vec3, max: Vec3) -> Vec3 {
        Vec3::new(self.range(min.x, max.x), self.range(min.y, max.y), self.range(min.z, max.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut random = Random::of_frame(1, "normal", 0);
        let values: Vec<f64> = (0..100_000).map(|_| f64::from(random.normal())).collect();
        let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / values.len() as f64;
        // Standard deviations of these means: 0.003, 0.004, 0.03.
        assert!(moment(1).abs() < 0.015 && (moment(2) - 1.0).abs() < 0.02, "{} {}", moment(1), moment(2));
        assert!((moment(4) - 3.0).abs() < 0.15, "{}", moment(4));
    }

    #[test]
    fn streams_differ_by_seed_scene_and_index() {
        let first = |seed, scene, index| Random::of_frame(seed, scene, index).bits();
        assert_eq!(first(1, "a", 2), first(1, "a", 2));
        let all =
            [first(1, "a", 2), first(2, "a", 2), first(1, "b", 2), first(1, "a", 3), first(1, "a\u{1}", 2)];
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].contains(a), "{all:x?}");
        }
    }

    #[test]
    fn draws_are_uniform() {
        let mut random = Random::of_frame(0, "uniform", 0);
        let n = 40_000;
        let mean = (0..n).map(|_| random.unit()).sum::<f32>() / n as f32;
        // 5 sigma of the mean of n uniform draws.
        assert!((mean - 0.5).abs() < 5.0 * (1.0f32 / 12.0 / n as f32).sqrt(), "{mean}");
        let mut counts = [0u32; 7];
        (0..n).for_each(|_| counts[random.below(7)] += 1);
        assert!(counts.iter().all(|c| c.abs_diff(n / 7) < 5 * 70), "{counts:?}");
        let log = (0..n).map(|_| random.log_range(0.01, 1.0).ln()).sum::<f32>() / n as f32;
        assert!((log - 0.1f32.ln()).abs() < 0.04, "{log}");
    }
}
