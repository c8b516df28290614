//! Packed products against the oracle's loops over numbers that were rounded as they are.

use super::*;
use crate::net::cpu::Precision;
use crate::net::cpu::dot::{Dot, DotKernel};
use crate::net::cpu::packing::{self, Packing, Steps};
use crate::net::cpu::ring::{Input, Ring};
use crate::net::model::Ranges;
use crate::net::plan::{CHANNEL_BLOCK, ConvStep, Step};
use crate::simd::Simd;
use half::bf16;

/// Inputs that were resampled may lie on the other side of a rounding's edge. Measured: 1.3e-8 at most.
const MAX_ROUNDED_NMSE: f64 = 5e-8;

/// Winograd's factors are rounded instead of inputs and weights. Measured against nothing rounded: 5.6e-4 at most.
const MAX_WINOGRAD_BF16_NMSE: f64 = 2e-3;

/// Of all inputs, which are noise in -1..1, and of no channel of the buffers' names.
fn ranges(names: &[String], channels: &[usize]) -> Ranges {
    names.iter().cloned().zip(channels.iter().map(|c| vec![[-1.0, 1.0]; *c])).collect()
}

/// As `Steps` rounds a value in -1..1.
fn rounded(precision: Precision, value: f32) -> f32 {
    match precision {
        Precision::F32 => value,
        Precision::Bf16 => bf16::from_f32(value).to_f32(),
        Precision::Int8 => ((value * 127.5 + 128.0).round_ties_even().clamp(0.0, 255.0) - 128.0) / 127.5,
    }
}

/// The weights of an output as they are packed.
fn rounded_filter(precision: Precision, filter: &[f32]) -> Vec<f32> {
    let largest = filter.iter().fold(0f32, |most, w| most.max(w.abs()));
    let step = |w: &f32| (w / largest * 127.0).round() * largest / 127.0;
    filter
        .iter()
        .map(|w| if precision == Precision::Int8 { step(w) } else { rounded(precision, *w) })
        .collect()
}

/// A convolution of `inputs` (layout, channels, resampling) to `outputs` channels of HxW `shape`.
fn check_conv(inputs: &[(Layout, usize, Resample)], outputs: usize, size: usize, shape: (usize, usize)) {
    let (height, width) = shape;
    let input_shape = |c: usize, how: Resample| match how {
        Resample::None => (c, height, width),
        Resample::AvgPool(side) => (c, side * height, side * width),
        Resample::Upsample2 => (c, height / 2, width / 2),
    };
    let mut shapes: Vec<_> = inputs.iter().map(|(layout, c, how)| (*layout, input_shape(*c, *how))).collect();
    shapes.push((Layout::Blocked, (outputs, height, width)));
    let (buffers, arena_len) = buffers(&shapes);
    let images: Vec<_> = shapes[..inputs.len()].iter().enumerate().map(|(i, s)| planes(s.1, i + 1)).collect();
    let sources: Vec<_> =
        inputs.iter().enumerate().map(|(buffer, i)| Source { buffer, resample: i.2 }).collect();
    let names: Vec<String> = (0..inputs.len()).map(|i| format!("input{i}")).collect();
    let written = |(output, name): (usize, &String)| {
        Step::Conv(ConvStep {
            name: name.clone(),
            sources: vec![],
            output,
            size: 3,
            groups: 1,
            activation: Activation::Linear,
        })
    };
    let steps = names.iter().enumerate().map(written).collect();
    let size_px = Size::px(width, height);
    let plan = Plan { size: size_px, padded: size_px, buffers, steps, arena_len };
    let channels: Vec<usize> = inputs.iter().map(|i| i.1).collect();
    let weights = weights([outputs, channels.iter().sum(), size, size]);
    let resampled = images.iter().zip(inputs).map(|(image, i)| resample(image, i.2));
    let joined = resampled.reduce(|a, b| naive::concat(&a, &b)).unwrap();
    let [w, b] = ["conv.weight", "conv.bias"].map(|name| &weights.get(name).values[..]);
    for precision in Precision::available().filter(|p| *p != Precision::F32) {
        let what = format!("{precision} {inputs:?} to {outputs}, filter {size}, image {shape:?}");
        let arithmetic = Arithmetic::new(Level::best(), precision).unwrap();
        let known = ranges(&names, &channels);
        let recipe = Recipe { plan: &plan, weights: &weights, arithmetic, ranges: Some(&known) };
        let step = ConvStep {
            name: "conv".to_owned(),
            sources: sources.clone(),
            output: inputs.len(),
            size,
            groups: 1,
            activation: Activation::LeakyRelu,
        };
        let found = |scratch_len: usize, run: &dyn Fn(Context<'_>)| {
            // Convolutions write 0 into channels that do not exist.
            let mut arena = Aligned::zeros(arena_len).unwrap();
            for (image, buffer) in images.iter().zip(&plan.buffers) {
                put(image, buffer, arithmetic.lanes(), &mut arena);
            }
            let mut workers = Workers::new(2, scratch_len).unwrap();
            run(Context { isa: arithmetic.isa(), workers: &mut workers, arena: &mut arena });
            let output = plan.buffers.last().unwrap();
            let at = |c, y, x: usize| arena[index(output, arithmetic.lanes(), (c, y, x as isize))];
            Planes::from_fn((outputs, height, width), at).values
        };
        let filters: Vec<f32> =
            w.chunks_exact(w.len() / outputs).flat_map(|filter| rounded_filter(precision, filter)).collect();
        let dims = (joined.channels, height, width);
        let inputs =
            Planes::from_fn(dims, |c, y, x| rounded(precision, joined.at(c, y as isize, x as isize)));
        let expected = naive::conv(&inputs, (&filters, b, size), Activation::LeakyRelu);
        let conv = Conv::new(&recipe, &step).unwrap();
        let error = nmse(&found(conv.scratch_len(), &|context| conv.run(context)), &expected.values);
        assert!(error <= MAX_ROUNDED_NMSE, "{what}: NMSE {error:e}");
        if size == 3 && precision == Precision::Bf16 {
            let exact = naive::conv(&joined, (w, b, size), Activation::LeakyRelu);
            let conv = Winograd::new(&recipe, &step).unwrap();
            let error = nmse(&found(conv.scratch_len(), &|context| conv.run(context)), &exact.values);
            assert!(error <= MAX_WINOGRAD_BF16_NMSE, "{what}, Winograd: NMSE {error:e}");
        }
    }
}

#[test]
fn packed_convolutions() {
    use Layout::{Blocked, Planar};
    use Resample::{AvgPool, None, Upsample2};
    for (inputs, outputs, size, shape) in [
        (&[(Planar, 48, None)][..], 32, 3, (7, 13)),
        (&[(Planar, 3, None)], 5, 3, (2, 1)),
        (&[(Blocked, 32, None)], 48, 3, (6, 40)),
        (&[(Blocked, 17, None)], 33, 3, (5, 31)),
        (&[(Blocked, 1, None)], 96, 1, (2, 25)),
        (&[(Blocked, 48, AvgPool(2))], 64, 3, (9, 1)),
        (&[(Blocked, 9, Upsample2), (Blocked, 18, None)], 50, 3, (14, 26)),
        (&[(Blocked, 16, Upsample2), (Planar, 3, None)], 16, 3, (2, 2)),
        (&[(Blocked, 33, AvgPool(2)), (Blocked, 31, AvgPool(2))], 16, 1, (17, 3)),
    ] {
        check_conv(inputs, outputs, size, shape);
    }
    for width in 1..=26 {
        check_conv(&[(Blocked, 5, None)], 40, 3, (3, width));
    }
}

#[test]
fn integers_need_ranges_that_fit() {
    let Ok(arithmetic) = Arithmetic::new(Level::best(), Precision::Int8) else {
        return;
    };
    let (buffers, arena_len) = buffers(&[(Layout::Planar, (4, 3, 3)), (Layout::Blocked, (16, 3, 3))]);
    let plan = Plan { size: Size::px(3, 3), padded: Size::px(3, 3), buffers, steps: vec![], arena_len };
    let weights = weights([16, 4, 3, 3]);
    let sources = vec![Source { buffer: 0, resample: Resample::None }];
    let activation = Activation::Linear;
    let step = ConvStep { name: "conv".to_owned(), sources, output: 1, size: 3, groups: 1, activation };
    let with = |ranges: Option<&Ranges>| {
        Conv::new(&Recipe { plan: &plan, weights: &weights, arithmetic, ranges }, &step).map(drop)
    };
    let known = |channels| ranges(&["features".to_owned()], &[channels]);
    assert!(with(Some(&known(4))).is_ok());
    for wrong in [Option::None, Some(&known(3)), Some(&ranges(&["other".to_owned()], &[4]))] {
        let error = with(wrong).unwrap_err().to_string();
        assert!(error.contains("4 channels of features"), "{error}");
    }
}

/// A pixel on its way through a ring's slot, a copy and both orders of a product: convolutions spread activations over
/// a vector, heads spread weights.
struct OnePixel<'a> {
    input: &'a Input,
    /// Of the pixel and its halo.
    source: &'a [f32],
    weights: f32,
    /// What lay in the slot.
    words: &'a mut Vec<f32>,
    sums: &'a mut [[f32; CHANNEL_BLOCK]; 2],
}

impl DotKernel for OnePixel<'_> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let (simd, words) = (dot.simd(), D::Simd::LANES / D::PACKED);
        let mut slots = vec![0.0; self.input.ring_len(1)];
        let mut ring = Ring::<1>::new(self.input, &mut slots);
        ring.fill(dot, self.input, self.source, [0]);
        self.words.extend_from_slice(&ring.row(self.input, self.source, 0)[HALO * words..][..words]);
        let mut sums = [dot.zero(); 2];
        for word in self.words.iter() {
            sums[0] = dot.add(dot.splat(*word), dot.load(&[self.weights; CHANNEL_BLOCK]), sums[0]);
            sums[1] = dot.add(dot.load(&[*word; CHANNEL_BLOCK]), dot.splat(self.weights), sums[1]);
        }
        for (sums, out) in sums.into_iter().zip(self.sums) {
            simd.store(dot.finish(sums, simd.splat(1.0), simd.splat(0.0)), out);
        }
    }
}

#[test]
fn words_that_look_like_signalling_nan_keep_their_bits() {
    let (mut buffers, _) = buffers(&[(Layout::Blocked, (CHANNEL_BLOCK, 1, 1))]);
    let buffer = buffers.remove(0);
    // Numbers of a word of activations and of weights, and their bits. An infinite bfloat16 would be a NaN if it were
    // quiet; a byte would be larger by 64.
    let (bf16, int8) = ([1.0, f32::INFINITY], ([1.0, 2.0, 150.0, 127.0], [3.0, -7.0, -100.0, 127.0]));
    for (precision, activations, weights, bits, expected) in [
        (Precision::Bf16, &bf16[..], &[1.0, f32::MAX][..], [0x7f80_3f80, 0x7f80_3f80], f32::INFINITY),
        (
            Precision::Int8,
            &int8.0,
            &int8.1,
            [0x7f96_0201, 0x7f9c_f903],
            4.0 * (3.0 - 14.0 - 15000.0 + 16129.0),
        ),
    ] {
        let Ok(arithmetic) = Arithmetic::new(Level::best(), precision) else { continue };
        let weights = packing::word(arithmetic, weights.iter().copied());
        assert_eq!(weights.to_bits(), bits[1], "{precision}: {weights:?}");
        let steps = Steps::new(&[[0.0, 255.0]; CHANNEL_BLOCK]).unwrap();
        let input =
            Input::new(buffer.clone(), Resample::None, 1, Packing { numbers: arithmetic.packed(), steps });
        let source = activations.repeat(3 * CHANNEL_BLOCK / activations.len());
        let (mut words, mut sums) = (Vec::new(), [[0.0; CHANNEL_BLOCK]; 2]);
        arithmetic.run(OnePixel {
            input: &input,
            source: &source,
            weights,
            words: &mut words,
            sums: &mut sums,
        });
        assert!(words.iter().all(|word| word.to_bits() == bits[0]), "{precision}: {words:?}");
        assert_eq!(sums, [[expected; CHANNEL_BLOCK]; 2], "{precision}");
    }
}
