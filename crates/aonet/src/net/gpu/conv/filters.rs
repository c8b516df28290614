//! The weights of a convolution in the order in which shaders read them.

use crate::net::gpu::memory::{BLOCK, blocks};

/// The shape of a convolution's weights.
pub(crate) struct Filters {
    /// Channels of each source.
    pub(crate) sources: Vec<usize>,
    pub(crate) outputs: usize,
    pub(crate) taps: usize,
    /// Groups of the convolution. Channels of other groups get filters of zeros.
    pub(crate) groups: usize,
}

impl Filters {
    /// By tile of outputs, block of inputs, tap, input of the block, output of the tile. Sources begin with a block.
    pub(crate) fn packed(&self, weight: &[f32], tile: usize) -> Vec<f32> {
        let in_blocks = self.blocks();
        let mut packed = vec![0.0; self.outputs.div_ceil(tile) * in_blocks * BLOCK * self.taps * tile];
        self.place(weight, |value, tap, [input, output]| {
            let block = output / tile * in_blocks + input / BLOCK;
            let line = (block * self.taps + tap) * BLOCK + input % BLOCK;
            packed[line * tile + output % tile] = value;
        });
        packed
    }

    /// Blocks of inputs.
    pub(crate) fn blocks(&self) -> usize {
        self.sources.iter().map(|channels| blocks(*channels)).sum()
    }

    /// Calls `put` with every weight, its tap, its input among the blocks of the sources, and its output.
    pub(crate) fn place(&self, weight: &[f32], mut put: impl FnMut(f32, usize, [usize; 2])) {
        let mut place = Vec::new();
        let mut in_blocks = 0;
        for channels in &self.sources {
            place.extend((0..*channels).map(|c| in_blocks * BLOCK + c));
            in_blocks += blocks(*channels);
        }
        let inputs = place.len() / self.groups;
        for (i, value) in weight.iter().enumerate() {
            let (tap, i) = (i % self.taps, i / self.taps);
            let (input, output) = (i % inputs, i / inputs);
            let input = place[output / (self.outputs / self.groups) * inputs + input];
            put(*value, tap, [input, output]);
        }
    }
}
