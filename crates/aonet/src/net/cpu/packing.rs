//! Numbers as packed words: which range of an input the steps of an integer cover, and what becomes of weights.

use super::precision::Arithmetic;
use crate::error::Result;
use crate::net::plan::CHANNEL_BLOCK;
use crate::simd::aligned::Aligned;

/// Steps above the first that an activation's byte can tell apart, and on each side of 0 that a weight's can.
const ACTIVATION_STEPS: f32 = 255.0;
const WEIGHT_STEPS: f32 = 127.0;

/// How the channels of an input become integers: step 0 is the least value; 0 itself lies on a step.
#[derive(Debug)]
pub(super) struct Steps {
    /// Steps per unit, by channel.
    pub(super) per_unit: Aligned,
    /// Where 0 lies, by channel.
    pub(super) zero: Aligned,
}

/// How the values of an input become words.
#[derive(Debug)]
pub(super) struct Packing {
    /// Numbers in a word.
    pub(super) numbers: usize,
    pub(super) steps: Steps,
}

impl Steps {
    /// For channels with these least and greatest values.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(ranges: &[[f32; 2]]) -> Result<Self> {
        let padded = ranges.len().next_multiple_of(CHANNEL_BLOCK);
        let (mut per_unit, mut zero) = (Aligned::zeros(padded)?, Aligned::zeros(padded)?);
        for (i, [least, greatest]) in ranges.iter().enumerate() {
            // A channel that is always 0 needs no steps; the smallest normal number keeps its weights finite.
            let span = (greatest.max(0.0) - least.min(0.0)).max(f32::MIN_POSITIVE * ACTIVATION_STEPS);
            per_unit[i] = ACTIVATION_STEPS / span;
            zero[i] = (-least.min(0.0) * per_unit[i]).round();
        }
        Ok(Self { per_unit, zero })
    }

    /// Numbers that are not integers.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn none(channels: usize) -> Result<Self> {
        let padded = channels.next_multiple_of(CHANNEL_BLOCK);
        Ok(Self { per_unit: Aligned::zeros(padded)?, zero: Aligned::zeros(padded)? })
    }

    /// The value of a step and the step of 0 of a channel.
    fn of(&self, channel: usize) -> (f32, f32) {
        (1.0 / self.per_unit[channel], self.zero[channel])
    }
}

/// The weights of one output, ready to be packed.
pub(super) struct Quantized {
    /// What a sum of products is worth.
    pub(super) scale: f32,
    /// What is added to it.
    pub(super) bias: f32,
}

/// Scales the `weights` of an output, which belong to channels of inputs (steps and channel, in order), in place, so that they can be
/// packed.
pub(super) fn quantize<'s>(
    arithmetic: Arithmetic,
    weights: &mut [f32],
    bias: f32,
    channels: impl Iterator<Item = (&'s Steps, usize)>,
) -> Quantized {
    if arithmetic.packed() < 4 {
        return Quantized { scale: 1.0, bias };
    }
    let mut zeros = Vec::with_capacity(weights.len());
    for (weight, (steps, channel)) in weights.iter_mut().zip(channels) {
        let (value, zero) = steps.of(channel);
        *weight *= value;
        zeros.push(zero);
    }
    let largest = weights.iter().fold(f32::MIN_POSITIVE * WEIGHT_STEPS, |most, w| most.max(w.abs()));
    let scale = largest / WEIGHT_STEPS;
    let mut offset = 0.0;
    for (weight, zero) in weights.iter_mut().zip(zeros) {
        *weight = (*weight / scale).round();
        offset += f64::from(*weight) * f64::from(zero);
    }
    Quantized { scale, bias: (f64::from(bias) - f64::from(scale) * offset) as f32 }
}

/// As many weights as fit a word, fewer if there are no more, as its bits.
pub(super) fn word(arithmetic: Arithmetic, weights: impl IntoIterator<Item = f32>) -> f32 {
    let mut bits = 0;
    for (i, weight) in weights.into_iter().take(arithmetic.packed()).enumerate() {
        let number = match arithmetic {
            Arithmetic::F32(_) => weight.to_bits(),
            #[cfg(target_arch = "x86_64")]
            Arithmetic::Bf16(_) => bf16_bits(weight),
            // Whole numbers between -127 and 127.
            #[cfg(target_arch = "x86_64")]
            Arithmetic::Int8(_) => u32::from(weight as i8 as u8),
        };
        bits |= number << (i * 32 / arithmetic.packed());
    }
    f32::from_bits(bits)
}

/// The nearest bfloat16 of a finite number, ties to even.
#[cfg(any(test, target_arch = "x86_64"))]
fn bf16_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    (bits + 0x7fff + (bits >> 16 & 1)) >> 16
}

#[cfg(test)]
mod tests {
    #[test]
    fn weights_are_rounded_as_others_round_them() {
        for i in 0..200_000u32 {
            let value = f32::from_bits(i.wrapping_mul(0x9e37_79b9));
            if value.is_finite() {
                let expected = u32::from(half::bf16::from_f32(value).to_bits());
                assert_eq!(super::bf16_bits(value), expected, "{value:e}");
            }
        }
    }
}
