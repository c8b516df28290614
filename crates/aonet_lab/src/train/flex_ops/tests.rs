//! Every way of convolving against plain loops with f64 sums.

use super::convolution::{Convolution, Wanted, Way};
use super::direct::Filter;
use super::resample::Resample;
use aonet::internals::simd::Isa;
use aonet::simd::Level;

/// Rounding of f32 sums, beside the largest value; measured 8e-7, allowed ten times that.
const ROUNDING: f64 = 8e-6;
/// The same for Winograd's transforms, whose sums have larger terms; measured 1e-5, allowed five times that.
const ROUNDING_AT_POINTS: f64 = 5e-5;

fn noise(seed: u64, len: usize) -> Vec<f32> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    (0..len).map(|_| next()).collect()
}

/// Calls `visit` with the places of a pixel, of a weight and of the output that adds their product.
fn each_product(c: &Convolution, mut visit: impl FnMut(usize, usize, usize)) {
    let (h, w, taps, half) = (c.height, c.width, c.size * c.size, c.size / 2);
    let clamped = |at: usize, tap: usize, end: usize| (at + tap).saturating_sub(half).min(end - 1);
    for plane in 0..c.batch * c.groups * c.outputs {
        let (item, o) = (plane / c.outputs, plane % (c.groups * c.outputs));
        for k in 0..c.inputs * taps {
            let (ty, tx) = (k % taps / c.size, k % c.size);
            for pixel in 0..h * w {
                let (y, x) = (clamped(pixel / w, ty, h), clamped(pixel % w, tx, w));
                let from = ((item * c.inputs + k / taps) * h + y) * w + x;
                visit(from, o * c.inputs * taps + k, plane * h * w + pixel);
            }
        }
    }
}

fn assert_close(what: &str, rounding: f64, expected: &[f64], found: &[f32]) {
    assert_eq!(expected.len(), found.len());
    let largest = expected.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
    let pairs = expected.iter().zip(found);
    let difference = pairs.map(|(e, f)| (e - f64::from(*f)).abs()).fold(0.0, f64::max);
    assert!(difference < rounding * largest, "{what}: {difference} of {largest}");
}

fn check(c: &Convolution) {
    let (images, planes) = (c.batch * c.groups, c.groups * c.outputs);
    let x = noise(1, images * c.inputs * c.pixels());
    let (weight, bias) = (noise(2, planes * c.inputs * c.size * c.size), noise(3, planes));
    let error = noise(4, images * c.outputs * c.pixels());
    let mut y: Vec<f64> = (0..error.len()).map(|i| f64::from(bias[i / c.pixels() % planes])).collect();
    let (mut image, mut filter) = (vec![0.0; x.len()], vec![0.0; weight.len()]);
    each_product(c, |i, k, o| {
        y[o] += f64::from(x[i]) * f64::from(weight[k]);
        image[i] += f64::from(error[o]) * f64::from(weight[k]);
        filter[k] += f64::from(error[o]) * f64::from(x[i]);
    });
    y.iter_mut().filter(|v| **v < 0.0).for_each(|v| *v *= 0.25);
    let name = format!("{:?}, {}x{}, {} to {}", c.way, c.height, c.width, c.inputs, c.outputs);
    let mut out = vec![f32::NAN; error.len()];
    c.forward(&x, Filter { weight: &weight, bias: &bias, slope: 0.25 }, &mut out);
    let rounding = if matches!(c.way, Way::Winograd(_)) { ROUNDING_AT_POINTS } else { ROUNDING };
    assert_close(&name, rounding, &y, &out);
    let (mut of_x, mut of_weight) = (vec![0.0; x.len()], vec![0.0; weight.len()]);
    c.backward(&x, &weight, &error, Wanted { image: Some(&mut of_x), filter: Some(&mut of_weight) });
    assert_close(&format!("{name}, image"), rounding, &image, &of_x);
    assert_close(&format!("{name}, filter"), rounding, &filter, &of_weight);
}

/// Sizes that leave vectors, tiles of outputs and bands of rows unfilled.
#[test]
fn every_way_to_convolve_agrees_with_plain_loops() {
    let isas: Vec<_> = Level::available().map(|level| Isa::new(level).unwrap()).collect();
    let narrow = isas.iter().flat_map(|isa| [Way::Direct(*isa), Way::Winograd(*isa)]);
    for way in narrow.chain([Way::Unfold]) {
        for [inputs, outputs, height, width] in
            [[1, 1, 1, 1], [3, 5, 2, 1], [2, 7, 1, 3], [5, 3, 7, 17], [9, 16, 5, 40], [24, 8, 39, 131]]
        {
            for (batch, groups) in [(1, 1), (2, 3)] {
                check(&Convolution { way, batch, groups, inputs, outputs, height, width, size: 3 });
            }
        }
    }
}

#[test]
#[should_panic(expected = "0.25 of 1")]
fn the_comparison_sees_one_wrong_value() {
    assert_close("", ROUNDING, &[0.5, 1.0], &[0.75, 1.0]);
}

/// <y, resample(x)> = <resample back(y), x> for every x and y.
#[test]
fn gradients_of_resampling_are_its_transposes() {
    for to in [Resample::Pool, Resample::Upsample] {
        for dims in [[1, 1, 2, 2], [2, 3, 4, 6], [1, 2, 2, 34]] {
            let x = noise(1, dims.iter().product());
            let y = to.forward(&x, dims);
            let slope = noise(2, y.len());
            let back = to.backward(&slope, dims);
            let dot = |a: &[f32], b: &[f32]| {
                a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()
            };
            let difference = (dot(&y, &slope) - dot(&x, &back)).abs();
            assert!(difference < ROUNDING * y.len() as f64, "{to:?}, {dims:?}: {difference}");
        }
    }
}
