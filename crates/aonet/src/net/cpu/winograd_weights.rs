//! Transformed weights in the order in which the multiplications read them.

use super::aligned::Aligned;
use super::conv_weights::split_vectors;
use super::packing;
use super::precision::Arithmetic;
use super::winograd_transforms::{PRODUCTS, filter};
use crate::error::Result;

/// Output channels that are computed together.
#[derive(Debug)]
pub(super) struct Group {
    /// Vectors of channels.
    pub(super) vectors: usize,
    /// By product, word of input channels, output channel.
    pub(super) weights: Aligned,
    /// By output channel.
    pub(super) bias: Aligned,
}

/// The filters of a 3x3 convolution, from OIHW `weight`, for inputs in blocks of these channels.
///
/// # Errors
/// When there is not enough memory.
pub(super) fn pack(
    (weight, bias): (&[f32], &[f32]),
    block_channels: &[usize],
    arithmetic: Arithmetic,
) -> Result<Vec<Group>> {
    let packed = arithmetic.packed();
    let inputs: usize = block_channels.iter().sum();
    let words: usize = block_channels.iter().map(|channels| channels.div_ceil(packed)).sum();
    let (filters, _) = weight.as_chunks::<9>();
    let mut first = 0;
    let group = |vectors: usize| {
        let wide = vectors * arithmetic.lanes();
        let outputs = first..bias.len().min(first + wide);
        first = outputs.end;
        let mut weights = Aligned::zeros(PRODUCTS * words * wide)?;
        for (o, output) in outputs.clone().enumerate() {
            let mut blocks = &filters[output * inputs..][..inputs];
            let mut word = 0;
            for channels in block_channels {
                let (block, rest) = blocks.split_at(*channels);
                for filters in block.chunks(packed) {
                    let mut products = [[0.0; PRODUCTS]; 2];
                    filters.iter().zip(&mut products).for_each(|(taps, products)| *products = filter(taps));
                    let places = weights[word * wide + o..].iter_mut().step_by(words * wide);
                    for (i, place) in places.enumerate() {
                        *place = packing::word(arithmetic, products.iter().map(|p| p[i]));
                    }
                    word += 1;
                }
                blocks = rest;
            }
        }
        let mut packed_bias = Aligned::zeros(wide)?;
        packed_bias[..outputs.len()].copy_from_slice(&bias[outputs]);
        Ok(Group { vectors, weights, bias: packed_bias })
    };
    split_vectors(bias.len().div_ceil(arithmetic.lanes()), arithmetic).into_iter().map(group).collect()
}
