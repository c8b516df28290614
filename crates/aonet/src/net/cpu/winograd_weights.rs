//! Transformed weights in the order in which the multiplications read them.

use super::aligned::Aligned;
use super::conv_weights::split_vectors;
use super::level::Isa;
use super::winograd_transforms::{PRODUCTS, filter};
use crate::error::Result;

/// Output channels that are computed together.
#[derive(Debug)]
pub(super) struct Group {
    /// Vectors of channels.
    pub(super) vectors: usize,
    /// By product, input channel, output channel.
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
    isa: Isa,
) -> Result<Vec<Group>> {
    let inputs: usize = block_channels.iter().sum();
    let (filters, _) = weight.as_chunks::<9>();
    let mut first = 0;
    let group = |vectors: usize| {
        let wide = vectors * isa.lanes();
        let outputs = first..bias.len().min(first + wide);
        first = outputs.end;
        let mut packed = Aligned::zeros(PRODUCTS * inputs * wide)?;
        for (o, output) in outputs.clone().enumerate() {
            for i in 0..inputs {
                let products = filter(&filters[output * inputs + i]);
                let places = packed[i * wide + o..].iter_mut().step_by(inputs * wide);
                places.zip(products).for_each(|(place, value)| *place = value);
            }
        }
        let mut packed_bias = Aligned::zeros(wide)?;
        packed_bias[..outputs.len()].copy_from_slice(&bias[outputs]);
        Ok(Group { vectors, weights: packed, bias: packed_bias })
    };
    split_vectors(bias.len().div_ceil(isa.lanes()), isa).into_iter().map(group).collect()
}
