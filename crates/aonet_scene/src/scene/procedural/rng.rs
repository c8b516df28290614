//! Seeded randomness that is the same everywhere: integer arithmetic and exactly rounded floats only.

use aonet::internals::random::{SplitMix64, mix};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A stream of random numbers. Equal seeds give equal streams on every machine.
#[derive(Debug, Clone)]
pub(super) struct Rng(SplitMix64);

impl Rng {
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = Self(SplitMix64::new(seed));
        rng.bits();
        rng
    }

    /// The stream of this seed for something of that name.
    pub(super) fn of(self, name: &str) -> Self {
        let state = name.bytes().fold(self.0.state, |state, byte| mix(state ^ u64::from(byte)));
        Self(SplitMix64::new(state))
    }

    fn bits(&mut self) -> u64 {
        self.0.bits()
    }

    /// An independent stream, so that what one object draws does not shift the next.
    pub(super) fn fork(&mut self) -> Self {
        Self::new(self.bits())
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        self.0.unit()
    }

    /// Uniform in [`lo`, `hi`).
    pub(super) fn range(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.unit()
    }

    /// Uniform in [-`half`, `half`).
    pub(super) fn spread(&mut self, half: f32) -> f32 {
        self.range(-half, half)
    }

    /// Uniform in [0, 2 pi).
    pub(super) fn angle(&mut self) -> f32 {
        self.range(0.0, TAU)
    }

    /// Uniform in `0..n`; 0 where `n` is 0.
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// Uniform in `lo..=hi`.
    pub(super) fn count(&mut self, lo: usize, hi: usize) -> usize {
        lo + self.below(hi - lo + 1)
    }

    /// True with probability `p`.
    pub(super) fn chance(&mut self, p: f32) -> bool {
        self.unit() < p
    }

    /// One of `items`, which must not be empty.
    pub(super) fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.below(items.len())]
    }

    /// Uniform in a rectangle about the origin.
    pub(super) fn in_rect(&mut self, half: Vec2) -> Vec2 {
        Vec2::new(self.spread(half.x), self.spread(half.y))
    }

    /// Uniform on the unit sphere.
    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.spread(1.0), self.spread(1.0), self.spread(1.0));
            let length = v.length();
            if length > 0.1 && length < 1.0 {
                return v / length;
            }
        }
    }
}

// lowbias32: Wellons 2018.
fn mix32(mut h: u32) -> u32 {
    h = (h ^ (h >> 16)).wrapping_mul(0x7FEB_352D);
    h = (h ^ (h >> 15)).wrapping_mul(0x846C_A68B);
    h ^ (h >> 16)
}

/// Smooth noise in [-1, 1], about one bump a unit length. Value noise on the integer lattice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn at(self, p: Vec3) -> f32 {
        let cell = p.floor();
        let t = p - cell;
        let t = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let [x, y, z] = cell.to_array().map(|c| c as i32 as u32);
        let corner = |dx: u32, dy: u32, dz: u32| {
            let key = x.wrapping_add(dx).wrapping_mul(0x8DA6_B343)
                ^ y.wrapping_add(dy).wrapping_mul(0xD816_3841)
                ^ z.wrapping_add(dz).wrapping_mul(0xCB1A_B31F);
            (mix32(key ^ self.0 as u32) >> 8) as f32 / (1u32 << 23) as f32 - 1.0
        };
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let edge = |dy, dz| lerp(corner(0, dy, dz), corner(1, dy, dz), t.x);
        let face = |dz| lerp(edge(0, dz), edge(1, dz), t.y);
        lerp(face(0), face(1), t.z)
    }

    /// Noise drawn from `rng`.
    pub(super) fn new(rng: &mut Rng) -> Self {
        Self(rng.bits())
    }

    /// Sum of `octaves` of noise, each twice as fine and half as strong.
    pub(super) fn fractal(self, p: Vec3, octaves: u32) -> f32 {
        (0..octaves)
            .fold((0.0, 1.0, p), |(sum, weight, p), _| (sum + weight * self.at(p), weight * 0.5, p * 2.03))
            .0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second output of seed 0, from the reference C code of SplitMix64.
    #[test]
    fn stream_is_splitmix64() {
        assert_eq!(Rng::new(0).bits(), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn draws_stay_in_range_and_fill_it() {
        let mut rng = Rng::new(7);
        let draws: Vec<f32> = (0..10_000).map(|_| rng.range(-2.0, 3.0)).collect();
        let mean = draws.iter().sum::<f32>() / 1e4;
        assert!(draws.iter().all(|d| (-2.0..3.0).contains(d)) && (mean - 0.5).abs() < 0.1, "{mean}");
        let counts: Vec<usize> = (0..1000).map(|_| rng.count(2, 4)).collect();
        assert!((2..=4).all(|n| counts.contains(&n)) && counts.iter().all(|n| (2..=4).contains(n)));
    }

    #[test]
    fn noise_is_bounded_and_continuous() {
        let noise = Noise(3);
        for i in 0..1000 {
            let p = Vec3::new(i as f32 * 0.037 - 18.0, i as f32 * 0.011, -(i as f32) * 0.023);
            let (a, b) = (noise.at(p), noise.at(p + Vec3::splat(1e-3)));
            assert!(a.abs() <= 1.0 && (a - b).abs() < 0.02, "{a} {b} at {p}");
        }
    }
}
