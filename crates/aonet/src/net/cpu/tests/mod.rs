//! Every op at every level against the oracle's loops.

mod features;
mod packed;

use crate::net::config::{KernelWeights, Output};
use crate::net::cpu::context::Context;
use crate::net::cpu::conv::Conv;
use crate::net::cpu::head::Head;
use crate::net::cpu::precision::{Arithmetic, Precision};
use crate::net::cpu::recipe::Recipe;
use crate::net::cpu::winograd::Winograd;
use crate::net::graph::{Activation, Graph, Op};
use crate::net::model::Ranges;
use crate::net::naive::{self, Planes};
use crate::net::neighbours;
use crate::net::plan::{Buffer, ConvStep, HALO, HeadStep, Layout, Lifetime, Plan, Resample, Source};
use crate::net::weights::{Tensor, Weights};
use crate::simd::aligned::Aligned;
use crate::simd::{Isa, Level};
use crate::threads::Workers;
use crate::{AoImage, Camera, GBuffer, Size};

/// Normalised mean square error. Measured: 3e-14 at most, from the order of summation.
const MAX_NMSE: f64 = 1e-12;

/// The same for Winograd's convolution, whose sums are of larger terms. Measured: 1.2e-12 at most.
const MAX_WINOGRAD_NMSE: f64 = 1e-11;

/// The same for heads that round what they multiply. Measured: 7e-6 in bf16 and 5e-5 in integers
/// at most.
const MAX_PACKED_HEAD_NMSE: f64 = 2e-4;

/// Words after the last buffer that nothing may write.
const GUARD: [f32; 64] = [f32::NAN; 64];

fn nmse(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let square = |v: f64| v * v;
    let error: f64 = found.iter().zip(expected).map(|(a, b)| square(f64::from(*a) - f64::from(*b))).sum();
    let power: f64 = expected.iter().map(|b| square(f64::from(*b))).sum();
    assert!(power > 0.0 || found.len() == 1, "nothing to compare with");
    // A single pixel may be clamped to nothing: then it must be nothing.
    if power == 0.0 && error == 0.0 { 0.0 } else { error / power }
}

fn assert_close(found: &[f32], expected: &[f32], what: &str) {
    let error = nmse(found, expected);
    assert!(error <= MAX_NMSE, "{what}: NMSE {error:e}");
}

/// Values in -1..1 that depend on the position only.
fn noise(i: usize, seed: usize) -> f32 {
    let mixed = (i.wrapping_mul(0x9e37_79b9) ^ seed.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 7;
    (mixed & 0xffff) as f32 / 32768.0 - 1.0
}

fn planes((channels, height, width): (usize, usize, usize), seed: usize) -> Planes {
    Planes::from_fn((channels, height, width), |c, y, x| noise((c * height + y) * width + x, seed))
}

/// Index of a value of a buffer in the arena; `x` may be in the halo.
fn index(buffer: &Buffer, lanes: usize, (c, y, x): (usize, usize, isize)) -> usize {
    let (pitch, x) = (buffer.width + 2 * HALO, (x + HALO as isize) as usize);
    let in_row = match buffer.layout {
        Layout::Planar => c * pitch + x,
        Layout::Blocked => (c / lanes * pitch + x) * lanes + c % lanes,
        Layout::Image => unreachable!("convolutions do not read images"),
    };
    buffer.offset + y * buffer.row_len() + in_row
}

fn put(image: &Planes, buffer: &Buffer, lanes: usize, arena: &mut [f32]) {
    for c in 0..image.channels {
        for y in 0..image.height {
            for x in -1..=image.width as isize {
                arena[index(buffer, lanes, (c, y, x))] = image.at(c, y as isize, x);
            }
        }
    }
}

/// Buffers one after the other.
fn buffers(shapes: &[(Layout, (usize, usize, usize))]) -> (Vec<Buffer>, usize) {
    let mut offset = 0;
    let place = |(layout, (channels, height, width)): &(Layout, (usize, usize, usize))| {
        let buffer = Buffer {
            offset,
            layout: *layout,
            channels: *channels,
            height: *height,
            width: *width,
            live: Lifetime { first: 0, last: 0 },
        };
        offset = buffer.range().end.next_multiple_of(16);
        buffer
    };
    (shapes.iter().map(place).collect(), offset)
}

/// Weights of one convolution.
fn weights(shape: [usize; 4]) -> Weights {
    let (mut graph, input) = Graph::with_input(shape[1]);
    let name = "conv".to_owned();
    graph.push(Op::Conv { input, name, size: shape[2], groups: 1, activation: Activation::Linear }, shape[0]);
    let tensor = |spec: crate::net::graph::ParamSpec| {
        let count = spec.shape.iter().product();
        (spec.name, Tensor { values: (0..count).map(|i| noise(i, count)).collect(), shape: spec.shape })
    };
    Weights::new(&graph, graph.params().into_iter().map(tensor).collect()).unwrap()
}

fn resample(image: &Planes, how: Resample) -> Planes {
    match how {
        Resample::None => image.clone(),
        Resample::AvgPool(1) => image.clone(),
        Resample::AvgPool(side) => resample(&naive::avg_pool2(image), Resample::AvgPool(side / 2)),
        Resample::Upsample2 => naive::upsample2(image),
    }
}

/// A convolution of `inputs` (layout, channels, what happens on the way in) to `out_channels` of HxW `size`.
fn check_conv(
    inputs: &[(Layout, usize, Resample)],
    out: (usize, Activation),
    [size, groups]: [usize; 2],
    shape: (usize, usize),
) {
    let what = format!("{inputs:?} to {out:?}, filter {size}, {groups} groups, image {shape:?}");
    let (height, width) = shape;
    let input_shape = |c: usize, how: Resample| match how {
        Resample::None => (c, height, width),
        Resample::AvgPool(side) => (c, side * height, side * width),
        Resample::Upsample2 => (c, height / 2, width / 2),
    };
    let mut shapes: Vec<_> = inputs.iter().map(|(layout, c, how)| (*layout, input_shape(*c, *how))).collect();
    shapes.push((Layout::Blocked, (out.0, height, width)));
    let (buffers, arena_len) = buffers(&shapes);
    let images: Vec<_> = shapes[..inputs.len()].iter().enumerate().map(|(i, s)| planes(s.1, i + 1)).collect();
    let sources: Vec<_> =
        inputs.iter().enumerate().map(|(buffer, i)| Source { buffer, resample: i.2 }).collect();
    let size_px = Size::px(width, height);
    let plan = Plan { size: size_px, padded: size_px, buffers, steps: vec![], arena_len };
    let weights = weights([out.0, inputs.iter().map(|i| i.1).sum::<usize>() / groups, size, size]);
    let resampled = images.iter().zip(inputs).map(|(image, i)| resample(image, i.2));
    let joined = resampled.reduce(|a, b| naive::concat(&a, &b)).unwrap();
    let [w, b] = ["conv.weight", "conv.bias"].map(|name| &weights.get(name).values[..]);
    let expected = naive::conv(&joined, (w, b, size), out.1);
    for level in Level::available() {
        let isa = Isa::new(level).unwrap();
        let step = ConvStep {
            name: "conv".to_owned(),
            sources: sources.clone(),
            output: inputs.len(),
            size,
            groups,
            activation: out.1,
        };
        let output = plan.buffers.last().unwrap();
        let with_halo =
            Planes::from_fn((out.0, height, width + 2), |c, y, x| expected.at(c, y as isize, x as isize - 1));
        let check = |scratch_len: usize, run: &dyn Fn(Context<'_>), max_nmse: f64| {
            let mut arena = Aligned::zeros(arena_len + GUARD.len()).unwrap();
            arena.fill(f32::NAN);
            for (image, buffer) in images.iter().zip(&plan.buffers) {
                put(image, buffer, isa.lanes(), &mut arena);
            }
            let before = arena.to_vec();
            let mut workers = Workers::new(2, scratch_len).unwrap();
            run(Context { isa, workers: &mut workers, arena: &mut arena });
            let found = Planes::from_fn((out.0, height, width + 2), |c, y, x| {
                arena[index(output, isa.lanes(), (c, y, x as isize - 1))]
            });
            let error = nmse(&found.values, &with_halo.values);
            assert!(error <= max_nmse, "{level:?} {what}: NMSE {error:e}, at most {max_nmse:e}");
            let outside = (0..before.len()).filter(|i| !output.range().contains(i));
            let same = |i: usize| before[i].to_bits() == arena[i].to_bits();
            assert!(outside.clone().all(same), "{level:?} {what}: wrote outside of its output");
        };
        let arithmetic = Arithmetic::F32(isa);
        let recipe = Recipe { plan: &plan, weights: &weights, arithmetic, ranges: Option::None };
        let conv = Conv::new(&recipe, &step).unwrap();
        check(conv.scratch_len(), &|context| conv.run(context), MAX_NMSE);
        if size == 3 && groups == 1 {
            let conv = Winograd::new(&recipe, &step).unwrap();
            check(conv.scratch_len(), &|context| conv.run(context), MAX_WINOGRAD_NMSE);
        }
    }
}

#[test]
fn convolutions() {
    use Activation::{LeakyRelu, Linear};
    use Layout::{Blocked, Planar};
    use Resample::{AvgPool, None, Upsample2};
    for (inputs, out, size, shape) in [
        (&[(Planar, 3, None)][..], (5, LeakyRelu), 3, (1, 1)),
        (&[(Planar, 48, None)], (32, LeakyRelu), 3, (7, 13)),
        (&[(Planar, 4, None)], (17, Linear), 1, (3, 29)),
        (&[(Blocked, 32, None)], (48, LeakyRelu), 3, (6, 40)),
        (&[(Blocked, 17, None)], (33, Linear), 3, (5, 31)),
        (&[(Blocked, 1, None)], (96, LeakyRelu), 3, (2, 25)),
        (&[(Blocked, 15, None)], (64, LeakyRelu), 1, (4, 11)),
        (&[(Blocked, 20, AvgPool(2))], (7, LeakyRelu), 3, (3, 5)),
        (&[(Blocked, 48, AvgPool(2))], (64, LeakyRelu), 3, (9, 1)),
        (&[(Blocked, 9, Upsample2)], (12, Linear), 3, (6, 10)),
        (&[(Blocked, 9, Upsample2), (Blocked, 18, None)], (50, LeakyRelu), 3, (14, 26)),
        (&[(Blocked, 16, Upsample2), (Planar, 3, None)], (16, LeakyRelu), 3, (2, 2)),
        (&[(Blocked, 33, AvgPool(2)), (Blocked, 31, AvgPool(2))], (16, LeakyRelu), 1, (17, 3)),
    ] {
        check_conv(inputs, out, [size, 1], shape);
    }
    for width in 1..=26 {
        check_conv(&[(Blocked, 5, None)], (40, LeakyRelu), [3, 1], (2, width));
    }
}

#[test]
fn grouped_convolutions() {
    use Activation::{LeakyRelu, Linear};
    use Layout::{Blocked, Planar};
    use Resample::{AvgPool, None, Upsample2};
    for (inputs, out, groups) in [
        (&[(Planar, 6, None)][..], (8, Linear), 2),
        (&[(Blocked, 8, AvgPool(2))], (16, LeakyRelu), 2),
        (&[(Blocked, 32, AvgPool(8))], (64, LeakyRelu), 8),
        (&[(Blocked, 256, Upsample2), (Blocked, 128, None)], (128, LeakyRelu), 16),
        (&[(Blocked, 32, Upsample2), (Blocked, 16, None)], (16, LeakyRelu), 2),
        (&[(Blocked, 21, None), (Planar, 3, None)], (36, LeakyRelu), 12),
    ] {
        check_conv(inputs, out, [3, groups], (6, 10));
    }
}

#[test]
fn images_of_any_height_are_cut_into_bands() {
    for height in 1..=20 {
        check_conv(&[(Layout::Blocked, 3, Resample::None)], (4, Activation::Linear), [3, 1], (height, 3));
        let up = [(Layout::Blocked, 3, Resample::Upsample2)];
        check_conv(&up, (4, Activation::Linear), [3, 1], (2 * height, 4));
    }
}

/// A wall in front of the camera, every fifth pixel background.
fn wall(width: usize, height: usize) -> GBuffer<'static> {
    let camera = Camera::perspective(0.1, Size::px(width, height)).unwrap();
    let depth = (0..width * height).map(|i| if i % 5 == 3 { f32::INFINITY } else { 1.0 }).collect::<Vec<_>>();
    GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; width * height]).unwrap()
}

/// A head and an image.
#[derive(Debug, Clone, Copy)]
struct HeadCase {
    /// Of the head's input.
    channels: usize,
    /// Side of a patch (px).
    patch: usize,
    kernel: KernelWeights,
    output: Output,
    /// Distances of neighbours (px).
    neighbours: &'static [usize],
    size: Size,
}

fn check_head(case: HeadCase) {
    let HeadCase { channels, patch, kernel, output, neighbours, size } = case;
    let values = if output == Output::Shares { 3 } else { 1 };
    let (width, height) = (size.width(), size.height());
    let cells = (height.div_ceil(patch), width.div_ceil(patch));
    let features = planes((channels, cells.0, cells.1), 1);
    let guide = planes((3, cells.0 * patch, cells.1 * patch), 2);
    let (buffers, arena_len) = buffers(&[
        (Layout::Blocked, (channels, cells.0, cells.1)),
        (Layout::Planar, (3 * patch * patch, cells.0, cells.1)),
        (Layout::Image, (values, height, width)),
    ]);
    let padded = Size::px(cells.1 * patch, cells.0 * patch);
    let plan = Plan { size: Size::px(width, height), padded, buffers, steps: vec![], arena_len };
    let outputs = (values + neighbours::count(neighbours)) * kernel.outputs_per_pixel();
    let weights = weights([patch * patch * outputs, channels, 1, 1]);
    let [w, b] = ["conv.weight", "conv.bias"].map(|name| &weights.get(name).values[..]);
    let kernels = naive::conv(&features, (w, b, 1), Activation::Linear);
    // Row by row, plane by plane.
    let base: Vec<f32> = (0..values * width * height).map(|i| 0.5 * noise(i, 77)).collect();
    let raw = match kernel {
        KernelWeights::Off => naive::patch_merge(&kernels, patch),
        KernelWeights::Linear | KernelWeights::Softmax => {
            naive::kernel_predict(&kernels, &guide, patch, kernel)
        }
    };
    let raw = match output {
        Output::Visibility => raw,
        Output::Correction | Output::Shares => {
            // Edges of the frame repeat.
            let (last, right) = (height - 1, width - 1);
            let found =
                |c: usize, y: usize, x: usize| base[(y.min(last) * values + c) * width + x.min(right)];
            naive::correct(&Planes::from_fn((values, raw.height, raw.width), found), &raw, neighbours)
        }
    };
    let gbuffer = wall(width, height);
    let expected: Vec<_> = (0..width * height)
        .map(|i| match gbuffer.is_foreground(i) {
            true => raw.at(0, (i / width) as isize, (i % width) as isize).clamp(0.0, 1.0),
            false => 1.0,
        })
        .collect();
    let corrected = (output != Output::Visibility).then_some(2);
    let ranges = Ranges::from([("features".to_owned(), vec![[-1.0, 1.0]; channels])]);
    let check = |arithmetic: Arithmetic, unwritten: f32, max_nmse: f64| {
        let recipe = Recipe { plan: &plan, weights: &weights, arithmetic, ranges: Some(&ranges) };
        let name = "conv".to_owned();
        let neighbours = neighbours.to_vec();
        let step =
            HeadStep { name, input: 0, guide: 1, patch, kernel, planes: values, neighbours, base: corrected };
        let head = Head::new(&recipe, &step).unwrap();
        let mut arena = Aligned::zeros(arena_len).unwrap();
        arena.fill(unwritten);
        put(&features, &plan.buffers[0], arithmetic.lanes(), &mut arena);
        put(&naive::patch_partition(&guide, patch), &plan.buffers[1], arithmetic.lanes(), &mut arena);
        arena[plan.buffers[2].range()].copy_from_slice(&base);
        let mut workers = Workers::new(2, head.scratch_len()).unwrap();
        let mut image = AoImage::open(size);
        image.visibility_mut().fill(f32::NAN);
        let context = Context { isa: arithmetic.isa(), workers: &mut workers, arena: &mut arena };
        head.run(context, &gbuffer, &mut image);
        let error = nmse(image.visibility(), &expected);
        assert!(error <= max_nmse, "{arithmetic:?} {case:?}: NMSE {error:e}, at most {max_nmse:e}");
    };
    for level in Level::available() {
        check(Arithmetic::F32(Isa::new(level).unwrap()), f32::NAN, MAX_NMSE);
    }
    // Channels that do not exist are 0 in what convolutions write; packed, they share words with others.
    for precision in Precision::available().filter(|p| *p != Precision::F32) {
        check(Arithmetic::new(Level::best(), precision).unwrap(), 0.0, MAX_PACKED_HEAD_NMSE);
    }
}

#[test]
fn heads() {
    use KernelWeights::{Linear, Off, Softmax};
    for patch in [1, 2, 4, 8] {
        for kernel in [Off, Linear, Softmax] {
            for output in [Output::Visibility, Output::Correction, Output::Shares] {
                if output == Output::Shares && kernel != Off {
                    continue;
                }
                let (size, neighbours) = (Size::px(70, 11), &[][..]);
                check_head(HeadCase { channels: 5, patch, kernel, output, neighbours, size });
            }
        }
        for output in [Output::Correction, Output::Shares] {
            for (neighbours, size) in
                [(&[1, 3][..], Size::px(300, 11)), (&[8], Size::px(3, 2)), (&[1, 2, 4, 8], Size::px(70, 5))]
            {
                check_head(HeadCase { channels: 5, patch, kernel: Off, output, neighbours, size });
            }
        }
    }
    for (width, height) in [(1, 1), (4, 4), (3, 9), (64, 4), (65, 5), (129, 4), (260, 3)] {
        for (channels, patch) in [(17, 4), (32, 1)] {
            let (output, size) = (Output::Visibility, Size::px(width, height));
            check_head(HeadCase { channels, patch, kernel: Linear, output, neighbours: &[], size });
        }
    }
}

#[test]
#[should_panic(expected = "NMSE")]
fn a_wrong_value_is_noticed() {
    let expected: Vec<_> = (0..1000).map(|i| noise(i, 1)).collect();
    let mut found = expected.clone();
    found[500] += 1e-4;
    assert_close(&found, &expected, "perturbed");
}
