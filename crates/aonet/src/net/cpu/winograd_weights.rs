//! Transformed weights in the order in which the multiplications read them.

use super::conv_weights::split_vectors;
use super::packing;
use super::precision::Arithmetic;
use super::recipe::Parameters;
use super::winograd_transforms::{PRODUCTS, filter};
use crate::error::Result;
use crate::simd::aligned::Aligned;

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

/// The filters of a 3x3 convolution, for inputs in blocks of these channels.
///
/// # Errors
/// When there is not enough memory.
pub(super) fn pack(
    parameters: Parameters<'_>,
    block_channels: &[usize],
    arithmetic: Arithmetic,
) -> Result<Vec<Group>> {
    let Parameters { weight, bias } = parameters;
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
        let mut word = 0;
        let mut first_in = 0;
        for channels in block_channels {
            for i in (first_in..first_in + channels).step_by(packed) {
                let seen = i..(i + packed).min(first_in + channels);
                let mut lines = vec![[0.0; PRODUCTS]; outputs.len()];
                for (line, output) in lines.iter_mut().zip(outputs.clone()) {
                    *line = filter_words(arithmetic, &filters[output * inputs..][seen.clone()]);
                }
                for product in 0..PRODUCTS {
                    let places = &mut weights[(product * words + word) * wide..];
                    places.iter_mut().zip(&lines).for_each(|(place, line)| *place = line[product]);
                }
                word += 1;
            }
            first_in += channels;
        }
        let mut packed_bias = Aligned::zeros(wide)?;
        packed_bias[..outputs.len()].copy_from_slice(&bias[outputs]);
        Ok(Group { vectors, weights, bias: packed_bias })
    };
    split_vectors(bias.len().div_ceil(arithmetic.lanes()), arithmetic).into_iter().map(group).collect()
}

/// The products' weights of the filters of a word of input channels.
fn filter_words(arithmetic: Arithmetic, filters: &[[f32; 9]]) -> [f32; PRODUCTS] {
    match filters {
        [taps] if arithmetic.packed() == 1 => filter(taps),
        [taps] => filter(taps).map(|weight| packing::word(arithmetic, [weight])),
        [first, second] => {
            let products = [filter(first), filter(second)];
            std::array::from_fn(|i| packing::word(arithmetic, products.map(|p| p[i])))
        }
        _ => unreachable!("{} floats in a word", filters.len()),
    }
}
