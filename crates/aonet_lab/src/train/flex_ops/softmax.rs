//! Kernels that sum to one: a softmax over the taps of each component.

use aonet::internals::kernel::{GUIDE_CHANNELS, TAPS};

/// Cells at a time: the taps of a component take 4 KiB.
const CELLS: usize = 64;
/// Taps of a component.
const WEIGHTS: usize = TAPS / GUIDE_CHANNELS;

/// Calls `visit` with where the taps of every component begin, a few cells at a time, and with the number of these cells. A tap's
/// cells lie `GUIDE_CHANNELS` planes of `plane` floats behind those of the tap before.
fn each_component(len: usize, plane: usize, mut visit: impl FnMut(usize, usize)) {
    for kernel in (0..len).step_by(TAPS * plane) {
        for first in (0..GUIDE_CHANNELS * plane).step_by(plane) {
            for cell in (0..plane).step_by(CELLS) {
                visit(kernel + first + cell, CELLS.min(plane - cell));
            }
        }
    }
}

/// The cells of tap `t` of a component that begins at `first`.
fn cells(first: usize, t: usize, plane: usize, count: usize) -> std::ops::Range<usize> {
    let from = first + t * GUIDE_CHANNELS * plane;
    from..from + count
}

/// `kernels`: for each pixel of a patch, [`TAPS`] planes of `plane` cells.
pub(super) fn forward(kernels: &[f32], plane: usize) -> Vec<f32> {
    let mut out = vec![0.0; kernels.len()];
    each_component(kernels.len(), plane, |first, count| {
        let mut largest = [f32::NEG_INFINITY; CELLS];
        for t in 0..WEIGHTS {
            let kernel = &kernels[cells(first, t, plane, count)];
            largest.iter_mut().zip(kernel).for_each(|(l, k)| *l = l.max(*k));
        }
        let mut sums = [0.0; CELLS];
        for t in 0..WEIGHTS {
            let at = cells(first, t, plane, count);
            let pairs = kernels[at.clone()].iter().zip(&largest).zip(&mut sums);
            for (out, ((kernel, largest), sum)) in out[at].iter_mut().zip(pairs) {
                *out = (kernel - largest).exp();
                *sum += *out;
            }
        }
        for t in 0..WEIGHTS {
            let out = &mut out[cells(first, t, plane, count)];
            out.iter_mut().zip(&sums).for_each(|(out, sum)| *out /= sum);
        }
    });
    out
}

/// The gradient of the kernels, from `weights`, what [`forward`] returned, and their gradient `slope`.
pub(super) fn backward(weights: &[f32], slope: &[f32], plane: usize) -> Vec<f32> {
    let mut out = vec![0.0; weights.len()];
    each_component(weights.len(), plane, |first, count| {
        let mut means = [0.0; CELLS];
        for t in 0..WEIGHTS {
            let at = cells(first, t, plane, count);
            let products = weights[at.clone()].iter().zip(&slope[at]);
            means.iter_mut().zip(products).for_each(|(mean, (w, s))| *mean += w * s);
        }
        for t in 0..WEIGHTS {
            let at = cells(first, t, plane, count);
            let pairs = weights[at.clone()].iter().zip(&slope[at.clone()]).zip(&means);
            out[at].iter_mut().zip(pairs).for_each(|(out, ((w, s), mean))| *out = w * (s - mean));
        }
    });
    out
}
