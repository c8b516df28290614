//! The GPU runtime against the oracle and the CPU runtime: whole networks, on any device there is.

mod common;
#[path = "common/device.rs"]
mod device;

use aonet::gpu::{Device, FrameViews, Kernels, Layers, Offscreen, Options, Precision, wgpu};
use aonet::net::gpu::Session;
use aonet::net::{Features, KernelWeights, Model, ModelConfig, Skips, cpu, shipped};
use aonet::{AoImage, AoParams, BentNormals, GBuffer, Size};
use common::{
    assert_close, behind_bars, embedding, frame, max_error, mean_error, mixing, mixing_shares, model, oracle,
    params, small, smoothing, spread, surveying, waves, weighing_shares,
};
use device::{Inputs, OPTIONS, device, inputs, on_the_cpu, read, target, too_large};

/// Largest difference between a session in 32-bit floats and the oracle; outputs lie in [0, 1]. Measured: 6e-7, from the
/// order of summation.
const TOLERANCE: f32 = 3e-6;

/// The same in 16-bit floats, with trained weights. Measured: 9e-4; a step of 8 bits is 4e-3.
const HALF_TOLERANCE: f32 = 3e-3;

/// Mean difference from the CPU's image where a horizon search takes part: a tap between two pixels may fall on either, and
/// the CPU's powers are cubics. Measured: 6e-6, in 16-bit floats 2.1e-5; of connected arcs 3.2e-5.
const HORIZON_MEAN_TOLERANCE: f32 = 1e-4;

/// The same in 16-bit floats, with trained weights. Measured: 1.2e-4, of a network with a survey of two layers.
const HALF_HORIZON_MEAN_TOLERANCE: f32 = 2e-4;

fn run((device, precision): (&Device, Precision), model: &Model, gbuffer: &GBuffer) -> AoImage {
    let layers = if gbuffer.second().is_some() { Layers::Two } else { Layers::One };
    let mut session = Offscreen::in_layers(device, model, (gbuffer.window(), layers), precision).unwrap();
    let mut image = AoImage::open(gbuffer.window().size());
    session.run(gbuffer, params(), &mut image).unwrap();
    image
}

/// Compares a network with the oracle.
fn check(device: &Device, config: ModelConfig, size: Size) {
    let what = format!("{config:?} at {size:?}");
    let model = model(config, 1);
    let gbuffer = frame(size, 2);
    let expected = oracle(&model, &gbuffer, params());
    if size.pixels() >= 64 {
        assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {what}");
    }
    let found = run((device, Precision::F32), &model, &gbuffer);
    assert_close(&found, &expected, (TOLERANCE, &what));
}

#[test]
fn every_row_of_tables_3_and_4() {
    let Some(device) = device() else { return };
    for features in [
        Features::normal(),
        Features::normal_encoded(),
        Features::normal_depth(),
        Features::normal_depth_normalized(),
        Features::normal_projected_radius(),
    ] {
        check(&device, ModelConfig { features, ..ModelConfig::paper() }, Size::px(70, 50));
    }
    for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
        for patch in [1, 2, 4, 8] {
            check(&device, small(Features::normal_projected_radius(), patch, kernel), Size::px(75, 21));
        }
    }
    check(&device, ModelConfig { skips: Skips::None, ..ModelConfig::paper() }, Size::px(33, 17));
}

#[test]
fn weights_of_shares_and_surveys() {
    let Some(device) = device() else { return };
    let kinds = |p| {
        [
            (p, weighing_shares(p)),
            (p, surveying(p)),
            (p, smoothing(p)),
            (p, mixing(p)),
            (p, mixing_shares(p)),
            (p, embedding(p)),
        ]
    };
    for (patch, config) in [1, 4, 8].into_iter().flat_map(kinds) {
        let model = model(config, 1);
        let bars = behind_bars(&waves(Size::px(75, 41)));
        for gbuffer in [frame(Size::px(45, 20), 2), bars.clone().without_second(), bars] {
            let expected = oracle(&model, &gbuffer, params());
            assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see");
            let found = run((&device, Precision::F32), &model, &gbuffer);
            let mean = mean_error(&found, &expected);
            assert!(mean <= HORIZON_MEAN_TOLERANCE, "patches of {patch}: {mean:e}");
        }
    }
}

#[test]
fn baselines() {
    let Some(device) = device() else { return };
    check(&device, ModelConfig::deep_shading(), Size::px(40, 33));
    check(&device, ModelConfig::deep_ao(), Size::px(45, 20));
}

#[test]
fn any_size() {
    let Some(device) = device() else { return };
    for size in [
        Size::px(1, 1),
        Size::px(2, 1),
        Size::px(3, 5),
        Size::px(33, 17),
        Size::px(31, 33),
        Size::px(129, 7),
        Size::px(5, 200),
    ] {
        check(&device, small(Features::normal_projected_radius(), 4, KernelWeights::Linear), size);
    }
    check(&device, small(Features::normal(), 1, KernelWeights::Linear), Size::px(65, 3));
}

#[test]
fn the_papers_weights_give_the_cpus_image() {
    let Some(device) = device() else { return };
    let model = Model::from_bytes(shipped::PAPER).unwrap();
    let gbuffer = frame(Size::px(130, 70), 3);
    let expected = on_cpu(&model, &gbuffer);
    for (precision, tolerance) in [(Precision::F32, TOLERANCE), (Precision::F16, HALF_TOLERANCE)] {
        let found = run((&device, precision), &model, &gbuffer);
        eprintln!("paper, {precision:?}, {:?}: {:e}", device.matrices, max_error(&found, &expected));
        assert_close(&found, &expected, (tolerance, &format!("{precision:?}")));
    }
    let without = Device { matrices: None, ..device };
    let found = run((&without, Precision::F16), &model, &gbuffer);
    assert_close(&found, &expected, (HALF_TOLERANCE, "no products of matrices"));
}

/// An off-centre camera and a guard band, with positions and a horizon search as features.
#[test]
fn cameras_and_margins() {
    let Some(device) = device() else { return };
    let camera = common::off_centre(Size::px(120, 83));
    let margin = aonet::Margin { x: 16, y: 9 };
    let guarded = common::waves_seen_by(camera).with_margin(margin).unwrap();
    for features in [Features::normal_projected_radius(), Features::normal_position()] {
        let model = model(small(features.clone(), 4, KernelWeights::Linear), 5);
        let expected = on_cpu(&model, &guarded);
        let found = run((&device, Precision::F32), &model, &guarded);
        assert_close(&found, &expected, (TOLERANCE, &format!("{features:?}")));
    }
}

fn on_cpu(model: &Model, gbuffer: &GBuffer) -> AoImage {
    let mut image = AoImage::open(gbuffer.window().size());
    cpu::Session::with_options(model, gbuffer.window(), cpu::Options::default())
        .unwrap()
        .run(gbuffer, params(), &mut image)
        .unwrap();
    image
}

#[test]
fn subgroups_give_the_cpus_image_and_are_used_where_they_are() {
    let Some(device) = device() else { return };
    let model = Model::from_bytes(shipped::PAPER).unwrap();
    let gbuffer = frame(Size::px(130, 70), 3);
    let options = Options { kernels: Kernels::Subgroups, ..OPTIONS };
    let session = session(&device, &model, Size::px(130, 70), options);
    let has = device.device.features().contains(wgpu::Features::SUBGROUP);
    assert_eq!(session.kernels(), if has { Kernels::Subgroups } else { Kernels::Plain });
    let found = encode(&device, &session, &gbuffer, OPTIONS.output);
    assert_close(&found, &on_cpu(&model, &gbuffer), (TOLERANCE, "subgroups"));
}

#[test]
fn networks_with_a_search() {
    let Some(device) = device() else { return };
    for (name, model) in [
        ("balanced", Model::from_bytes(shipped::BALANCED).unwrap()),
        ("high", Model::from_bytes(shipped::HIGH).unwrap()),
        ("shares of every pixel", model(weighing_shares(4), 1)),
    ] {
        for gbuffer in [
            frame(Size::px(1, 1), 4),
            frame(Size::px(33, 17), 4),
            frame(Size::px(130, 70), 4),
            waves(Size::px(120, 80)),
            behind_bars(&waves(Size::px(120, 80))),
        ] {
            let expected = on_cpu(&model, &gbuffer);
            for (precision, tolerance) in
                [(Precision::F32, HORIZON_MEAN_TOLERANCE), (Precision::F16, HALF_HORIZON_MEAN_TOLERANCE)]
            {
                let found = run((&device, precision), &model, &gbuffer);
                let mean = mean_error(&found, &expected);
                let what = format!("{name}, {}x{}, {precision:?}", gbuffer.width(), gbuffer.height());
                eprintln!("{what}: mean {mean:e}, largest {:e}", max_error(&found, &expected));
                assert!(mean <= tolerance, "{what}: {mean:e}");
            }
        }
    }
}

fn session(device: &Device, model: &Model, size: Size, options: Options) -> Session {
    Session::new((&device.device, &device.queue), model, size, options).unwrap()
}

/// One frame through a session.
fn encode(device: &Device, session: &Session, gbuffer: &GBuffer, format: wgpu::TextureFormat) -> AoImage {
    let Inputs { normal, depth, frame, .. } = inputs(device, gbuffer, params());
    let visibility = target(device, gbuffer.size(), format);
    let view = session
        .bind(FrameViews { normal: &normal, depth: &depth, second: None, visibility: &visibility })
        .unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &view, &frame).unwrap();
    read(device, encoder, &visibility)
}

#[test]
fn outputs_of_8_and_16_bits_round_the_image() {
    let Some(device) = device() else { return };
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 1);
    let gbuffer = frame(Size::px(50, 30), 5);
    let expected = oracle(&model, &gbuffer, params());
    // Direct3D lets GPUs be off by 0.6 steps of 8 bits (measured on an H100: 0.55); half floats may be cut off instead of rounded: a
    // whole step.
    let steps = if on_the_cpu(&device) { 0.5 } else { 0.6 };
    for (output, off) in
        [(wgpu::TextureFormat::R8Unorm, steps / 255.0), (wgpu::TextureFormat::R16Float, 4.9e-4)]
    {
        let session = session(&device, &model, Size::px(50, 30), Options { output, ..OPTIONS });
        let found = encode(&device, &session, &gbuffer, output);
        assert_close(&found, &expected, (off + TOLERANCE, &format!("{output:?}")));
    }
}

#[test]
fn a_resized_session_its_sibling_and_a_new_one_agree() {
    let Some(device) = device() else { return };
    let model = model(small(Features::normal_depth_normalized(), 4, KernelWeights::Linear), 1);
    let gbuffer = frame(Size::px(70, 40), 6);
    let mut resized = session(&device, &model, Size::px(20, 90), OPTIONS);
    let sibling = resized.sibling(Size::px(70, 40)).unwrap();
    resized.resize(Size::px(70, 40)).unwrap();
    assert!(too_large(&device).is_none_or(|size| resized.resize(size).is_err()));
    assert_eq!(resized.size(), Size::px(70, 40), "an error changes nothing");
    let new = encode(&device, &session(&device, &model, Size::px(70, 40), OPTIONS), &gbuffer, OPTIONS.output);
    for (session, what) in [(&resized, "resized"), (&sibling, "sibling"), (&resized, "again")] {
        assert_eq!(encode(&device, session, &gbuffer, OPTIONS.output), new, "{what}");
    }
}

#[test]
fn views_of_one_submission_keep_their_cameras() {
    let Some(device) = device() else { return };
    let model = model(small(Features::normal_projected_radius(), 4, KernelWeights::Linear), 1);
    let size = Size::px(40, 30);
    let gbuffers = [frame(size, 7), frame(size, 8)];
    let session = session(&device, &model, size, OPTIONS);
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let targets = [0, 1].map(|i| {
        let Inputs { normal, depth, mut frame, .. } = inputs(&device, &gbuffers[i], params());
        frame.params = AoParams::new(frame.params.radius() * (1.0 + i as f32)).unwrap();
        let visibility = target(&device, size, OPTIONS.output);
        let view = session
            .bind(FrameViews { normal: &normal, depth: &depth, second: None, visibility: &visibility })
            .unwrap();
        session.encode(&mut encoder, &view, &frame).unwrap();
        (visibility, frame.params)
    });
    let first = read(&device, encoder, &targets[0].0);
    let second = read(&device, device.device.create_command_encoder(&Default::default()), &targets[1].0);
    for (found, i) in [(first, 0), (second, 1)] {
        let expected = oracle(&model, &gbuffers[i], targets[i].1);
        assert_close(&found, &expected, (TOLERANCE, &format!("view {i}")));
    }
}

#[test]
fn a_changed_weight_is_noticed() {
    let Some(device) = device() else { return };
    let config = small(Features::normal(), 4, KernelWeights::Linear);
    let (model, gbuffer) = (model(config.clone(), 1), frame(Size::px(60, 40), 9));
    let mut tensors = model.weights().tensors().clone();
    tensors.get_mut("enc1.conv1.weight").unwrap().values[40] += 0.1;
    let weights = aonet::internals::weights::Weights::new(model.graph(), tensors).unwrap();
    let changed = Model::new(config, weights, Default::default()).unwrap();
    let expected = oracle(&model, &gbuffer, params());
    let found = run((&device, Precision::F32), &changed, &gbuffer);
    assert!(max_error(&found, &expected) > 10.0 * TOLERANCE);
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(device) = device() else { return };
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 1);
    let gbuffer = frame(Size::px(20, 10), 1);
    let mut session = Offscreen::new(&device, &model, Size::px(20, 10), Precision::F32).unwrap();
    let mut image = AoImage::open(Size::px(20, 10));
    session.run(&gbuffer, params(), &mut image).unwrap();
    device.device.destroy();
    let found = session.run(&gbuffer, params(), &mut image).unwrap_err().to_string();
    assert!(found.contains("device"), "{found}");
    assert!(Offscreen::new(&device, &model, Size::px(20, 10), Precision::F32).is_err());
}

#[test]
fn wrong_sizes_formats_and_frames_are_errors() {
    let Some(device) = device() else { return };
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 1);
    let new = |size| Session::new((&device.device, &device.queue), &model, size, OPTIONS);
    let error = |e: aonet::Error| e.to_string();
    if let Some(size) = too_large(&device) {
        assert!(error(new(size).unwrap_err()).contains(&size.to_string()));
    }
    let session = new(Size::px(20, 10)).unwrap();
    let good = inputs(&device, &frame(Size::px(20, 10), 1), params());
    let bad = inputs(&device, &frame(Size::px(10, 20), 1), params());
    let [r32, r8] = [wgpu::TextureFormat::R32Float, wgpu::TextureFormat::R8Unorm];
    let (visibility, wrong) = (target(&device, Size::px(20, 10), r32), target(&device, Size::px(20, 10), r8));
    let textures =
        FrameViews { normal: &good.normal, depth: &good.depth, second: None, visibility: &visibility };
    for (textures, what) in [
        (FrameViews { normal: &bad.normal, ..textures }, "normal"),
        (FrameViews { depth: &bad.depth, ..textures }, "depth"),
        (FrameViews { visibility: &wrong, ..textures }, "R8Unorm"),
        (FrameViews { visibility: &good.depth, ..textures }, "RENDER_ATTACHMENT"),
        // Cannot be read by shaders.
        (FrameViews { depth: &visibility, ..textures }, "device"),
    ] {
        let found = error(session.bind(textures).unwrap_err());
        assert!(found.contains(what), "{what}: {found}");
    }
    let view = session.bind(textures).unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    assert!(session.encode(&mut encoder, &view, &bad.frame).is_err(), "a camera of another size");
    let other = session.sibling(Size::px(10, 20)).unwrap();
    assert!(other.encode(&mut encoder, &view, &bad.frame).is_err(), "a view of another size");
}

#[test]
fn a_network_gives_the_bent_normals_of_its_search() {
    let Some(device) = device() else { return };
    let gbuffer = waves(Size::px(120, 83));
    let size = gbuffer.size();
    let of = |bytes| Model::from_bytes(bytes).unwrap();
    for model in [of(shipped::FAST), of(shipped::BALANCED), model(weighing_shares(4), 1)] {
        let (mut image, mut expected) = (AoImage::open(size), BentNormals::zeros(size));
        let mut session = cpu::Session::with_bent_normals(&model, size, cpu::Options::default()).unwrap();
        session.run_with_bent_normals(&gbuffer, params(), &mut image, &mut expected).unwrap();
        let (mut visibility, mut found) = (AoImage::open(size), BentNormals::zeros(size));
        let frames = (size, Layers::One);
        let mut session = Offscreen::with_bent_normals(&device, &model, frames, Precision::F32).unwrap();
        session.run_with_bent_normals(&gbuffer, params(), &mut visibility, &mut found).unwrap();
        let pairs = found.directions().iter().zip(expected.directions());
        // Half the squared distance: 1 minus the cosine of unit vectors, and 0 on the background.
        let off = pairs.map(|(a, b)| 0.5 * (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>());
        let mean = off.sum::<f32>() / size.pixels() as f32;
        // A thousandth is 2.6 degrees; taps between two pixels may fall on either.
        assert!(mean < 1e-4, "{mean:e}");
        let mut alone = AoImage::open(size);
        Offscreen::new(&device, &model, size, Precision::F32)
            .unwrap()
            .run(&gbuffer, params(), &mut alone)
            .unwrap();
        assert!(mean_error(&visibility, &alone) < HORIZON_MEAN_TOLERANCE);
    }
    let paper = model(ModelConfig::paper(), 1);
    let refused = Offscreen::with_bent_normals(&device, &paper, (size, Layers::One), Precision::F32);
    assert!(refused.unwrap_err().to_string().contains("search"));
}
