//! Every operation on a device against the oracle's loops.

use crate::frame::size::Size;
use crate::gpu::options::{Kernels, Layers, Precision};
use crate::gpu::program::{Arithmetic, BufferId, Dispatches};
use crate::gpu::surface::Surface;
use crate::gpu::wgpu_30::device::Device;
use crate::gpu::wgpu_30::errors::scoped;
use crate::gpu::wgpu_30::host::Host;
use crate::net::config::KernelWeights;
use crate::net::gpu::context::Context;
use crate::net::gpu::conv::Conv;
use crate::net::gpu::grids::Grids;
use crate::net::gpu::head::Head;
use crate::net::gpu::memory::{BLOCK, Memory, blocks};
use crate::net::gpu::valid::{KERNELS, MATRICES, PRECISIONS};
use crate::net::graph::{Activation, Graph, Op};
use crate::net::naive::{self, Planes};
use crate::net::plan::{Buffer, ConvStep, HeadStep, Layout, Lifetime, Plan, Resample, Source};
use crate::net::weights::{Tensor, Weights};
use std::sync::Arc;

/// Normalised mean square error. Measured: 1.5e-13 from the order of summation, 1.6e-6 from rounding to halves.
const MAX_NMSE: [(Precision, f64); 2] = [(Precision::F32, 1e-12), (Precision::F16, 1e-5)];

/// What tests run on, at both precisions and with all kernels if the device has them; none, said so, where there is no
/// device.
fn devices() -> Vec<On> {
    let Some(Device { device, queue, matrices, .. }) = test_device() else { return vec![] };
    let has = |feature| device.features().contains(feature);
    let precisions =
        PRECISIONS.into_iter().filter(|p| *p == Precision::F32 || has(wgpu::Features::SHADER_F16));
    let all = precisions.flat_map(|precision| KERNELS.map(|kernels| (precision, kernels)));
    let all = all.filter(|(_, kernels)| *kernels == Kernels::Plain || has(wgpu::Features::SUBGROUP));
    let all = all.chain(matrices.map(|matrices| (Precision::F16, Kernels::Matrices(matrices))));
    let host = Arc::new(Host::new((&device, &queue), Layers::One));
    let on =
        |(precision, kernels)| On { host: Arc::clone(&host), arithmetic: Arithmetic { precision, kernels } };
    all.map(on).collect()
}

/// A device and how it is to compute.
#[derive(Clone)]
struct On {
    host: Arc<Host>,
    arithmetic: Arithmetic,
}

impl On {
    fn context<'a>(&self, plan: &'a Plan, grids: &'a Grids, memory: &'a Memory) -> Context<'a> {
        let surface = Surface { precision: self.arithmetic.precision, textures: Default::default() };
        Context { arithmetic: self.arithmetic, surface, plan, grids, memory }
    }
}

fn test_device() -> Option<Device> {
    match Device::wait_for() {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn nmse(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let square = |v: f64| v * v;
    let error: f64 = found.iter().zip(expected).map(|(a, b)| square(f64::from(*a) - f64::from(*b))).sum();
    let power: f64 = expected.iter().map(|b| square(f64::from(*b))).sum();
    assert!(power > 0.0, "nothing to compare with");
    error / power
}

fn assert_close(found: &[f32], expected: &[f32], (precision, what): (Precision, &str)) {
    let error = nmse(found, expected);
    let most = MAX_NMSE.iter().find(|(p, _)| *p == precision).unwrap().1;
    // NaN is no match either.
    assert!(error <= most, "{what}, {precision:?}: NMSE {error:e}");
}

/// Values in -1..1 that depend on the position only.
fn noise(i: usize, seed: usize) -> f32 {
    let mixed = (i.wrapping_mul(0x9e37_79b9) ^ seed.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 7;
    (mixed & 0xffff) as f32 / 32768.0 - 1.0
}

fn planes((channels, height, width): (usize, usize, usize), seed: usize) -> Planes {
    Planes::from_fn((channels, height, width), |c, y, x| noise((c * height + y) * width + x, seed))
}

/// An image as blocks of four channels.
fn blocked(image: &Planes) -> Vec<f32> {
    let mut values = vec![0.0; blocks(image.channels) * BLOCK * image.height * image.width];
    for (i, value) in image.values.iter().enumerate() {
        let (c, pixel) = (i / (image.height * image.width), i % (image.height * image.width));
        values[(c / BLOCK * image.height * image.width + pixel) * BLOCK + c % BLOCK] = *value;
    }
    values
}

/// The inverse.
fn unblocked(values: &[f32], (channels, height, width): (usize, usize, usize)) -> Planes {
    Planes::from_fn((channels, height, width), |c, y, x| {
        values[((c / BLOCK * height + y) * width + x) * BLOCK + c % BLOCK]
    })
}

/// Tensors and a plan of them that all live at once; the last is the output.
fn plan_of(shapes: &[(usize, usize, usize)]) -> Plan {
    let buffer = |(channels, height, width): &(usize, usize, usize)| Buffer {
        offset: 0,
        layout: Layout::Blocked,
        channels: *channels,
        height: *height,
        width: *width,
        live: Lifetime { first: 0, last: 0 },
    };
    let (_, height, width) = shapes[shapes.len() - 1];
    let size = Size::px(width, height);
    Plan { size, padded: size, buffers: shapes.iter().map(buffer).collect(), steps: vec![], arena_len: 0 }
}

/// A tensor as bytes.
fn tensor(image: &Planes, precision: Precision) -> Vec<u8> {
    let values = blocked(image).into_iter();
    match precision {
        Precision::F32 => values.flat_map(f32::to_le_bytes).collect(),
        Precision::F16 => values.flat_map(|v| half::f16::from_f32(v).to_le_bytes()).collect(),
    }
}

/// Runs the only pass of a list, which sees no frame, on these buffers' contents; reads `output` back.
fn run(
    on: &On,
    list: &Dispatches,
    inputs: &[(BufferId, &Planes)],
    output: BufferId,
) -> crate::Result<Vec<u8>> {
    let (host, device) = (&on.host, &on.host.device);
    // Whatever the size of the frames, which nothing depends on.
    let list = list.at(Size::px(1, 1), on.arithmetic.precision)?;
    let buffers = host.buffers(&list.buffers)?;
    for (buffer, image) in inputs {
        host.queue.write_buffer(&buffers[*buffer], 0, &tensor(image, on.arithmetic.precision));
    }
    let pass = &list.passes[0];
    let pass = scoped(device, "pass", || Ok(host.pass(pass, &list.shaders[pass.shader], &buffers, true)))?;
    let buffer = &buffers[output];
    let back = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.encode_alone(&mut encoder.begin_compute_pass(&Default::default()));
    encoder.copy_buffer_to_buffer(buffer, 0, &back, 0, buffer.size());
    host.queue.submit([encoder.finish()]);
    back.map_async(wgpu::MapMode::Read, .., Result::unwrap);
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    Ok(back.get_mapped_range(..).unwrap().to_vec())
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn reals(bytes: &[u8], precision: Precision) -> Vec<f32> {
    match precision {
        Precision::F32 => floats(bytes),
        Precision::F16 => {
            bytes.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32()).collect()
        }
    }
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
        Resample::None | Resample::AvgPool(1) => image.clone(),
        Resample::AvgPool(side) => resample(&naive::avg_pool2(image), Resample::AvgPool(side / 2)),
        Resample::Upsample2 => naive::upsample2(image),
    }
}

/// A convolution to check.
#[derive(Debug, Clone, Copy)]
struct ConvCase<'a> {
    /// Channels of each input, and how it is read.
    inputs: &'a [(usize, Resample)],
    outputs: usize,
    activation: Activation,
    /// Side of the filter.
    filter: usize,
    groups: usize,
    /// Columns and rows of the output.
    size: Size,
}

/// Checks a convolution with few and with many rows of an invocation, and on matrices with all shapes of workgroups.
fn check_conv(on: &[On], case: ConvCase<'_>) {
    let ConvCase { inputs, outputs, activation, filter, groups, size } = case;
    let (width, height) = (size.width(), size.height());
    let what = format!("{case:?}");
    let input_shape = |(c, how): &(usize, Resample)| match how {
        Resample::None => (*c, height, width),
        Resample::AvgPool(side) => (*c, side * height, side * width),
        Resample::Upsample2 => (*c, height / 2, width / 2),
    };
    let shapes: Vec<_> = inputs.iter().map(input_shape).chain([(outputs, height, width)]).collect();
    let images: Vec<_> = shapes[..inputs.len()].iter().enumerate().map(|(i, s)| planes(*s, i + 1)).collect();
    let sources: Vec<_> =
        inputs.iter().enumerate().map(|(buffer, i)| Source { buffer, resample: i.1 }).collect();
    let plan = plan_of(&shapes);
    let weights = weights([outputs, inputs.iter().map(|i| i.0).sum::<usize>() / groups, filter, filter]);
    let resampled = images.iter().zip(inputs).map(|(image, i)| resample(image, i.1));
    let joined = resampled.reduce(|a, b| naive::concat(&a, &b)).unwrap();
    let [w, b] = ["conv.weight", "conv.bias"].map(|name| &weights.get(name).values[..]);
    let expected = naive::conv(&joined, (w, b, filter), activation);
    for on in on {
        let (name, output) = ("conv".to_owned(), inputs.len());
        let step = ConvStep { name, sources: sources.clone(), output, size: filter, groups, activation };
        let conv = Conv::new(on.arithmetic, &plan, &weights, &step);
        let shapes = match on.arithmetic.kernels {
            Kernels::Matrices(_) => conv.shapes(on.arithmetic.kernels),
            Kernels::Plain | Kernels::Subgroups => vec![[4, 1], [1, 1]],
        };
        for shape in shapes {
            let mut list = Dispatches::default();
            let grids = Grids::fixed(&plan);
            let memory = Memory::new(&plan.buffers, &grids, &mut list);
            conv.push_of_shapes(&on.context(&plan, &grids, &memory), &[shape], &mut list);
            let inputs: Vec<_> = images.iter().enumerate().map(|(i, image)| (memory.of(i), image)).collect();
            let found = run(on, &list, &inputs, memory.of(images.len())).unwrap();
            let found = unblocked(&reals(&found, on.arithmetic.precision), (outputs, height, width));
            assert_close(
                &found.values,
                &expected.values,
                (on.arithmetic.precision, &format!("{shape:?}, {:?}, {what}", on.arithmetic.kernels)),
            );
        }
    }
}

#[test]
fn convolutions() {
    use Activation::{LeakyRelu, Linear};
    use Resample::{AvgPool, None, Upsample2};
    let on = devices();
    for (inputs, outputs, activation, filter, size) in [
        (&[(3, None)][..], 5, LeakyRelu, 3, Size::px(1, 1)),
        (&[(48, None)], 32, LeakyRelu, 3, Size::px(13, 7)),
        (&[(4, None)], 17, Linear, 1, Size::px(29, 3)),
        (&[(32, None)], 48, LeakyRelu, 3, Size::px(40, 6)),
        (&[(17, None)], 33, Linear, 3, Size::px(31, 5)),
        (&[(1, None)], 96, LeakyRelu, 3, Size::px(25, 2)),
        (&[(20, AvgPool(2))], 7, LeakyRelu, 3, Size::px(5, 3)),
        (&[(9, AvgPool(8))], 8, Linear, 3, Size::px(3, 2)),
        (&[(9, Upsample2)], 12, Linear, 3, Size::px(10, 6)),
        (&[(9, Upsample2), (18, None)], 50, LeakyRelu, 3, Size::px(26, 14)),
        (&[(16, Upsample2), (3, None)], 16, LeakyRelu, 3, Size::px(2, 2)),
        (&[(33, AvgPool(2)), (31, AvgPool(4)), (2, None)], 56, LeakyRelu, 1, Size::px(3, 17)),
    ] {
        check_conv(&on, ConvCase { inputs, outputs, activation, filter, groups: 1, size });
    }
}

#[test]
fn grouped_convolutions() {
    use Activation::{LeakyRelu, Linear};
    use Resample::{AvgPool, None, Upsample2};
    let on = devices();
    let size = Size::px(10, 6);
    for (inputs, outputs, activation, groups) in [
        (&[(6, None)][..], 8, Linear, 2),
        (&[(32, AvgPool(8))], 64, LeakyRelu, 8),
        (&[(256, Upsample2), (128, None)], 128, LeakyRelu, 16),
        (&[(21, None), (3, None)], 36, LeakyRelu, 12),
    ] {
        check_conv(&on, ConvCase { inputs, outputs, activation, filter: 3, groups, size });
    }
}

/// A head to check.
#[derive(Debug, Clone, Copy)]
struct HeadCase {
    channels: usize,
    /// Side of a patch (px).
    patch: usize,
    kernel: KernelWeights,
    /// Values for each pixel.
    planes: usize,
    /// Columns and rows of patches.
    cells: Size,
}

fn check_head(on: &[On], case: HeadCase) {
    let HeadCase { channels, patch, kernel, planes: values, cells } = case;
    let (width, height) = (cells.width(), cells.height());
    let what = format!("{case:?}");
    let outputs = patch * patch * values * kernel.outputs_per_pixel();
    let weights = weights([outputs, channels, 1, 1]);
    let [w, b] = ["conv.weight", "conv.bias"].map(|name| &weights.get(name).values[..]);
    let input = planes((channels, height, width), 3);
    let guide = planes((4, height * patch, width * patch), 4);
    let kernels = naive::conv(&input, (w, b, 1), Activation::Linear);
    let expected = match kernel {
        KernelWeights::Off => kernels,
        KernelWeights::Linear | KernelWeights::Softmax => {
            naive::patch_partition(&naive::kernel_predict(&kernels, &guide, patch, kernel), patch)
        }
    };
    let mut plan = plan_of(&[(channels, height, width), (4 * patch * patch, height, width)]);
    plan.padded = Size::px(width * patch, height * patch);
    let guide_cells = naive::patch_partition(&guide, patch);
    for on in on {
        let mut list = Dispatches::default();
        let grids = Grids::fixed(&plan);
        let memory = Memory::new(&plan.buffers, &grids, &mut list);
        let step = HeadStep {
            name: "conv".to_owned(),
            input: 0,
            guide: 1,
            patch,
            kernel,
            planes: values,
            neighbours: vec![],
            base: None,
        };
        let head = Head::new(on.arithmetic, &plan, &weights, &step);
        let raw = list.storage("raw", head.raw_len(&grids) * 4.into());
        head.push(&on.context(&plan, &grids, &memory), raw, &mut list);
        let inputs = [(memory.of(0), &input), (memory.of(1), &guide_cells)];
        let found = floats(&run(on, &list, &inputs, raw).unwrap());
        assert_close(
            &found,
            &expected.values,
            (on.arithmetic.precision, &format!("{:?}, {what}", on.arithmetic.kernels)),
        );
    }
}

#[test]
fn heads() {
    use KernelWeights::{Linear, Off, Softmax};
    let on = devices();
    for patch in [1, 2, 4, 8] {
        for kernel in [Off, Linear, Softmax] {
            check_head(&on, HeadCase { channels: 5, patch, kernel, planes: 1, cells: Size::px(9, 4) });
        }
        check_head(&on, HeadCase { channels: 5, patch, kernel: Off, planes: 6, cells: Size::px(9, 4) });
    }
    for cells in [Size::px(1, 1), Size::px(17, 3), Size::px(33, 9)] {
        check_head(&on, HeadCase { channels: 33, patch: 4, kernel: Linear, planes: 1, cells });
    }
}

/// What shaders on matrices do besides multiplying, whether the device has matrices or not.
#[test]
fn matrices_spelt_out() {
    use Activation::{LeakyRelu, Linear};
    use Resample::{AvgPool, None, Upsample2};
    let subgroups = Arithmetic { precision: Precision::F16, kernels: Kernels::Subgroups };
    for on in devices().into_iter().filter(|on| on.arithmetic == subgroups) {
        let with = |matrices| {
            let kernels = Kernels::Matrices(matrices);
            On { arithmetic: Arithmetic { kernels, ..subgroups }, ..on.clone() }
        };
        let on: Vec<_> = MATRICES.into_iter().filter(|m| m.spelt_out).map(with).collect();
        for (inputs, outputs, activation, filter, groups, size) in [
            (&[(20, None)][..], 17, LeakyRelu, 3, 1, Size::px(19, 7)),
            (&[(9, Upsample2), (18, AvgPool(2))], 50, Linear, 3, 1, Size::px(10, 6)),
            (&[(6, None)], 8, LeakyRelu, 1, 2, Size::px(1, 1)),
        ] {
            check_conv(&on, ConvCase { inputs, outputs, activation, filter, groups, size });
        }
        for (channels, patch, kernel, cells) in
            [(33, 4, KernelWeights::Linear, Size::px(17, 5)), (5, 1, KernelWeights::Softmax, Size::px(9, 4))]
        {
            check_head(&on, HeadCase { channels, patch, kernel, planes: 1, cells });
        }
    }
}

#[test]
fn buffers_beyond_the_devices_limit_are_errors() {
    for on in devices() {
        let mut list = Dispatches::default();
        list.storage("everything", usize::MAX / 2);
        let list = list.at(Size::px(1, 1), on.arithmetic.precision).unwrap();
        let error = on.host.buffers(&list.buffers).unwrap_err().to_string();
        assert!(error.contains("everything") && error.contains("limit"), "{error}");
    }
}

#[test]
#[should_panic(expected = "NMSE")]
fn a_wrong_value_is_noticed() {
    let expected: Vec<_> = (0..1000).map(|i| noise(i, 1)).collect();
    let mut found = expected.clone();
    found[500] += 1e-4;
    assert_close(&found, &expected, (Precision::F32, "perturbed"));
}
