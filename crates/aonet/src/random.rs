//! Random bits for weights, scenes, rays and datasets: a seed gives the same stream on every machine.

/// A stream of random bits. Equal seeds give equal streams.
// SplitMix64: Steele et al. 2014, "Fast Splittable Pseudorandom Number Generators".
#[derive(Debug, Clone)]
pub struct SplitMix64 {
    /// Everything that the stream remembers.
    pub state: u64,
}

impl SplitMix64 {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    /// Uniform in [0, 1): the upper 24 of the next 64 bits.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in 0..`n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
}

/// A bijection whose output bits all depend on all input bits: the finaliser of [`SplitMix64`].
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::SplitMix64;

    /// First outputs of seed 0, from the reference C code of SplitMix64.
    #[test]
    fn stream_is_splitmix64() {
        let mut stream = SplitMix64::new(0);
        assert_eq!([stream.bits(), stream.bits()], [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4]);
    }
}
