//! The weights of NNAO, their file, and the network for one pixel, for whoever trains it.

use super::nnao_taps::{INPUTS, NnaoTap};
use crate::error::{Error, Result};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::ops::{Add, Mul};

/// Side of the first layer's filter (cells); it spans the disk of the AO radius.
pub const SIDE: usize = 31;
/// Units of both hidden layers.
pub const HIDDEN: usize = 4;

/// Where each layer begins in [`NnaoWeights::values`]; slopes are pairs, below and above zero.
const HIDDEN_BIAS: usize = SIDE * SIDE * INPUTS * HIDDEN;
const FIRST_SLOPES: usize = HIDDEN_BIAS + HIDDEN;
const DENSE: usize = FIRST_SLOPES + 2 * HIDDEN;
const DENSE_BIAS: usize = DENSE + HIDDEN * HIDDEN;
const SECOND_SLOPES: usize = DENSE_BIAS + HIDDEN;
const OUTPUT: usize = SECOND_SLOPES + 2 * HIDDEN;
const OUTPUT_BIAS: usize = OUTPUT + HIDDEN;
/// Number of trained values.
pub const COUNT: usize = OUTPUT_BIAS + 1;

/// Trained weights.
#[derive(Debug, Clone, PartialEq)]
pub struct NnaoWeights {
    /// [`COUNT`] values: the filter (row from the top, column, input, hidden unit), then bias, slopes, dense layer,
    /// bias, slopes, output, bias.
    values: Vec<f32>,
    standard: Standard,
}

/// How inputs are standardised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Standard {
    /// Mean of every input.
    pub(crate) mean: [f32; INPUTS],
    /// One over its standard deviation.
    pub(crate) scale: [f32; INPUTS],
}

impl NnaoWeights {
    /// Weights from [`COUNT`] values and the inputs' means and standard deviations.
    ///
    /// # Errors
    /// When the number of values is wrong, or one is not finite, or a deviation is not above 0.
    pub fn new(values: Vec<f32>, mean: [f32; INPUTS], deviation: [f32; INPUTS]) -> Result<Self> {
        if values.len() != COUNT {
            return Err(Error::weights("values", COUNT, values.len()));
        }
        if let Some(bad) = values.iter().chain(&mean).find(|v| !v.is_finite()) {
            return Err(Error::weights("values", "finite values", bad));
        }
        if let Some(bad) = deviation.iter().find(|d| !(d.is_finite() && **d > 0.0)) {
            return Err(Error::weights("deviation", "finite values > 0", bad));
        }
        Ok(Self { values, standard: Standard { mean, scale: deviation.map(|d| 1.0 / d) } })
    }

    /// Reads a safetensors file that [`NnaoWeights::to_bytes`] wrote.
    ///
    /// # Errors
    /// When the bytes are no such file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let wrong =
            |found: String| Error::format("NNAO weights", "safetensors with values and standard", found);
        let file = SafeTensors::deserialize(bytes).map_err(|e| wrong(e.to_string()))?;
        let tensor = |name: &str| -> Result<Vec<f32>> {
            let view = file.tensor(name).map_err(|e| wrong(e.to_string()))?;
            if view.dtype() != Dtype::F32 {
                return Err(wrong(format!("{:?}", view.dtype())));
            }
            Ok(view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
        };
        let standard = tensor("standard")?;
        let [mean, deviation] =
            [0, INPUTS].map(|at| standard.get(at..).and_then(|s| s.first_chunk().copied()));
        let (Some(mean), Some(deviation)) = (mean, deviation) else {
            return Err(wrong(format!("{} values of standard", standard.len())));
        };
        Self::new(tensor("values")?, mean, deviation)
    }

    /// The weights as a safetensors file.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let Standard { mean, scale } = self.standard;
        let standard = bytes(&[mean, scale.map(|s| 1.0 / s)].concat());
        let values = bytes(&self.values);
        let wrong =
            |e: safetensors::SafeTensorError| Error::format("NNAO weights", "tensors that fit in a file", e);
        let view = |shape: usize, data| TensorView::new(Dtype::F32, vec![shape], data).map_err(wrong);
        let views = [("standard", view(2 * INPUTS, &standard)?), ("values", view(COUNT, &values)?)];
        safetensors::serialize(views, None).map_err(wrong)
    }

    /// The trained values, in the order of the file.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    pub(crate) fn standard(&self) -> Standard {
        self.standard
    }

    pub(crate) fn hidden_bias(&self) -> [f32; HIDDEN] {
        std::array::from_fn(|h| self.values[HIDDEN_BIAS + h])
    }

    /// The filter at a place in the unit disk, bilinearly: input by hidden unit.
    pub(crate) fn filter_at(&self, place: [f32; 2]) -> [f32; INPUTS * HIDDEN] {
        let mut filter = [0.0; INPUTS * HIDDEN];
        for (cell, share) in cells(place) {
            let from = &self.values[cell * INPUTS * HIDDEN..][..INPUTS * HIDDEN];
            filter.iter_mut().zip(from).for_each(|(f, v)| *f += share * v);
        }
        filter
    }

    /// All layers after the first one's sum.
    #[inline(always)]
    pub(crate) fn head<T: Unit>(&self, hidden: [T; HIDDEN]) -> T {
        let v = |at: usize| self.values[at];
        let slopes = |at: usize, h: usize| [v(at + 2 * h), v(at + 2 * h + 1)];
        let mut first = hidden;
        for h in 0..HIDDEN {
            first[h] = hidden[h].prelu(slopes(FIRST_SLOPES, h));
        }
        let mut second = first;
        for (o, unit) in second.iter_mut().enumerate() {
            let row = DENSE + o * HIDDEN;
            let sum =
                first[0] * v(row) + first[1] * v(row + 1) + first[2] * v(row + 2) + first[3] * v(row + 3);
            *unit = (sum + v(DENSE_BIAS + o)).prelu(slopes(SECOND_SLOPES, o));
        }
        let sum = second[0] * v(OUTPUT) + second[1] * v(OUTPUT + 1);
        sum + second[2] * v(OUTPUT + 2) + second[3] * v(OUTPUT + 3) + v(OUTPUT_BIAS)
    }

    /// Occlusion of one pixel before clamping.
    pub fn occlusion(&self, taps: &[NnaoTap]) -> f32 {
        self.head(self.hidden(taps))
    }

    /// Sums of the hidden units of the first layer.
    fn hidden(&self, taps: &[NnaoTap]) -> [f32; HIDDEN] {
        let mut hidden = self.hidden_bias();
        for tap in taps {
            let (filter, inputs) = (self.filter_at(tap.place), self.standardised(tap));
            for (h, sum) in hidden.iter_mut().enumerate() {
                *sum += (0..INPUTS).map(|c| inputs[c] * filter[c * HIDDEN + h]).sum::<f32>();
            }
        }
        hidden
    }

    /// Inputs as the filter sees them.
    fn standardised(&self, tap: &NnaoTap) -> [f32; INPUTS] {
        let Standard { mean, scale } = self.standard;
        std::array::from_fn(|c| tap.near * (tap.inputs[c] - mean[c]) * scale[c])
    }

    /// Adds the gradient of `slope` times the occlusion with respect to the values to `gradient`. Returns the occlusion.
    pub fn backward(&self, taps: &[NnaoTap], slope: impl Fn(f32) -> f32, gradient: &mut [f32]) -> f32 {
        let hidden = self.hidden(taps);
        let (occlusion, into_hidden) = self.backward_head(hidden, slope, gradient);
        for h in 0..HIDDEN {
            gradient[HIDDEN_BIAS + h] += into_hidden[h];
        }
        for tap in taps {
            let inputs = self.standardised(tap);
            for (cell, share) in cells(tap.place) {
                let into = &mut gradient[cell * INPUTS * HIDDEN..][..INPUTS * HIDDEN];
                for (k, g) in into.iter_mut().enumerate() {
                    *g += share * inputs[k / HIDDEN] * into_hidden[k % HIDDEN];
                }
            }
        }
        occlusion
    }

    /// The same for all layers after the first one's sums. Returns the occlusion, and its gradient with respect to the sums.
    fn backward_head(
        &self,
        hidden: [f32; HIDDEN],
        slope: impl Fn(f32) -> f32,
        gradient: &mut [f32],
    ) -> (f32, [f32; HIDDEN]) {
        let v = |at: usize| self.values[at];
        let slopes = |at: usize, h: usize| [v(at + 2 * h), v(at + 2 * h + 1)];
        let first: [f32; HIDDEN] = std::array::from_fn(|h| hidden[h].prelu(slopes(FIRST_SLOPES, h)));
        let sums: [f32; HIDDEN] = std::array::from_fn(|o| {
            v(DENSE_BIAS + o) + (0..HIDDEN).map(|h| first[h] * v(DENSE + o * HIDDEN + h)).sum::<f32>()
        });
        let second: [f32; HIDDEN] = std::array::from_fn(|o| sums[o].prelu(slopes(SECOND_SLOPES, o)));
        let occlusion = v(OUTPUT_BIAS) + (0..HIDDEN).map(|o| second[o] * v(OUTPUT + o)).sum::<f32>();

        let top = slope(occlusion);
        gradient[OUTPUT_BIAS] += top;
        let mut into_first = [0.0; HIDDEN];
        for o in 0..HIDDEN {
            gradient[OUTPUT + o] += top * second[o];
            let above = top * v(OUTPUT + o);
            let side = usize::from(sums[o] > 0.0);
            gradient[SECOND_SLOPES + 2 * o + side] += above * sums[o];
            let sum = above * v(SECOND_SLOPES + 2 * o + side);
            gradient[DENSE_BIAS + o] += sum;
            for h in 0..HIDDEN {
                gradient[DENSE + o * HIDDEN + h] += sum * first[h];
                into_first[h] += sum * v(DENSE + o * HIDDEN + h);
            }
        }
        let into_hidden = std::array::from_fn(|h| {
            let side = usize::from(hidden[h] > 0.0);
            gradient[FIRST_SLOPES + 2 * h + side] += into_first[h] * hidden[h];
            into_first[h] * v(FIRST_SLOPES + 2 * h + side)
        });
        (occlusion, into_hidden)
    }

    /// Values to start training from: small filters, slopes of 0.2 and 1, an output near a bright image.
    pub fn start(unit: &mut dyn FnMut() -> f32) -> Vec<f32> {
        let mut values: Vec<f32> = (0..COUNT).map(|_| 2.0 * unit() - 1.0).collect();
        values[..HIDDEN_BIAS].iter_mut().for_each(|v| *v *= 0.2);
        for at in [FIRST_SLOPES, SECOND_SLOPES] {
            values[at..at + 2 * HIDDEN].iter_mut().enumerate().for_each(|(i, v)| *v = [0.2, 1.0][i % 2]);
        }
        for at in [HIDDEN_BIAS, DENSE_BIAS] {
            values[at..at + HIDDEN].fill(0.0);
        }
        values[OUTPUT_BIAS] = 0.1;
        values
    }
}

/// What the layers compute with: one pixel's number, or many at once.
pub(crate) trait Unit:
    Copy + Mul<f32, Output = Self> + Add<f32, Output = Self> + Add<Self, Output = Self>
{
    /// Times one slope below zero and times another one above.
    fn prelu(self, slopes: [f32; 2]) -> Self;
}

impl Unit for f32 {
    fn prelu(self, [below, above]: [f32; 2]) -> f32 {
        if self > 0.0 { self * above } else { self * below }
    }
}

/// The four cells of the filter about a place in the unit disk, and their shares.
fn cells([x, y]: [f32; 2]) -> [(usize, f32); 4] {
    let last = (SIDE - 1) as f32;
    let (fx, fy) = ((0.5 + 0.5 * x) * last, (0.5 - 0.5 * y) * last);
    let (column, row) = (fx.floor().clamp(0.0, last - 1.0), fy.floor().clamp(0.0, last - 1.0));
    let (sx, sy) = ((fx - column).clamp(0.0, 1.0), (fy - row).clamp(0.0, 1.0));
    let cell = row as usize * SIDE + column as usize;
    [
        (cell, (1.0 - sx) * (1.0 - sy)),
        (cell + 1, sx * (1.0 - sy)),
        (cell + SIDE, (1.0 - sx) * sy),
        (cell + SIDE + 1, sx * sy),
    ]
}
