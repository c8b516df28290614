//! The CPU runtime against the oracle: whole networks.

mod common;

use aonet::internals::graph::Graph;
use aonet::internals::naive;
use aonet::internals::weights::Weights;
use aonet::net::cpu::{Options, Precision, Session};
use aonet::net::{Features, KernelWeights, Model, ModelConfig, Output, Ranges, Skips, TrainingFacts};
use aonet::simd::Level;
use aonet::{AoImage, GBuffer, Size};
use common::{
    assert_close, behind_bars, camera, embedding, frame, max_error, mixing, mixing_shares, model, oracle,
    params, seeing, small, smoothing, spread, surveying, waves, weighing_shares,
};

/// Largest difference between a session and the oracle. Measured over all tests here: 5e-7, from the order of
/// summation; outputs lie in [0, 1].
const TOLERANCE: f32 = 2e-6;

/// The same for a session whose horizon search rounds differently from the oracle's, which has the best instructions:
/// AVX-512's reciprocal root is off by 6e-5. Measured: 2.8e-5.
const SEARCH_TOLERANCE: f32 = 1e-4;

const KERNELS: [KernelWeights; 3] = [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax];

fn run(model: &Model, gbuffer: &GBuffer, (threads, level): (usize, Level)) -> AoImage {
    let mut session =
        Session::with_options(model, gbuffer.window(), Options { threads, level, precision: Precision::F32 })
            .unwrap();
    let mut image = AoImage::open(gbuffer.window().size());
    session.run(gbuffer, params(), &mut image).unwrap();
    image
}

/// Compares every level with the oracle.
fn check(config: ModelConfig, size: Size) {
    let what = format!("{config:?} at {size:?}");
    let model = model(config, 1);
    let gbuffer = frame(size, 2);
    let expected = oracle(&model, &gbuffer, params());
    if size.pixels() >= 64 {
        assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {what}");
    }
    for level in Level::available() {
        let searches_alike = model.config().search.is_none() || level == Level::best();
        let tolerance = if searches_alike { TOLERANCE } else { SEARCH_TOLERANCE };
        assert_close(
            &run(&model, &gbuffer, (2, level)),
            &expected,
            (tolerance, &format!("{level:?} {what}")),
        );
    }
}

#[test]
fn every_row_of_tables_3_and_4() {
    let all = [
        Features::normal(),
        Features::normal_depth(),
        Features::normal_depth_normalized(),
        Features::normal_projected_radius(),
        Features::normal_radius_horizon(),
        Features::normal_encoded(),
    ];
    for features in all {
        check(seeing(features), Size::px(70, 33));
    }
    for patch in [1, 4] {
        for kernel in KERNELS {
            check(ModelConfig { patch, kernel, ..ModelConfig::paper() }, Size::px(45, 20));
        }
    }
    check(ModelConfig { skips: Skips::None, ..ModelConfig::paper() }, Size::px(45, 20));
}

#[test]
fn corrections() {
    for patch in [1, 2, 4, 8] {
        check(ModelConfig { patch, ..ModelConfig::correcting() }, Size::px(70, 33));
    }
    check(
        ModelConfig { encoder: vec![16, 32], decoder: vec![16], ..ModelConfig::correcting() },
        Size::px(1, 1),
    );
    let small = ModelConfig { encoder: vec![16, 32], decoder: vec![16], ..ModelConfig::correcting() };
    for patch in [1, 4] {
        for kernel in [KernelWeights::Linear, KernelWeights::Softmax] {
            check(ModelConfig { patch, kernel, ..small.clone() }, Size::px(45, 20));
        }
    }
    // A search that the network corrects and does not see, and one that it sees and does not correct.
    check(ModelConfig { features: Features::normal(), ..small.clone() }, Size::px(45, 20));
    check(ModelConfig { output: Output::Visibility, ..small }, Size::px(45, 20));
}

#[test]
fn weights_of_shares_and_surveys() {
    // The filter's powers are polynomials. Measured: 1.5e-5.
    let filtered = 4e-5;
    let kinds = |p| {
        let weighing = weighing_shares(p);
        let settling = ModelConfig { smooth: true, ..weighing.clone() };
        [
            (TOLERANCE, weighing),
            (TOLERANCE, mixing_shares(p)),
            (TOLERANCE, surveying(p)),
            (filtered, settling),
            (filtered, smoothing(p)),
            (filtered, mixing(p)),
            (filtered, embedding(p)),
        ]
        .map(|(tolerance, config)| (p, tolerance, config))
    };
    for (patch, tolerance, config) in [1, 2, 4, 8].into_iter().flat_map(kinds) {
        let model = model(config, 1);
        let noise = frame(Size::px(45, 20), 2);
        let bars = behind_bars(&waves(Size::px(70, 33)));
        let one_layer = bars.clone().without_second();
        for gbuffer in [noise, bars, one_layer] {
            let expected = oracle(&model, &gbuffer, params());
            assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see");
            // Angles fall into other sectors with other instructions.
            let found = run(&model, &gbuffer, (2, Level::best()));
            assert_close(&found, &expected, (tolerance, &format!("patches of {patch}")));
        }
    }
}

#[test]
fn weights_of_neighbours_change_the_image() {
    let gbuffer = behind_bars(&waves(Size::px(70, 33)));
    let with = model(mixing(4), 1);
    let mut tensors = with.weights().tensors().clone();
    // The first of 17 planes is the correction.
    for name in ["head.weight", "head.bias"] {
        let values = &mut tensors.get_mut(name).unwrap().values;
        let first = values.len() / 17;
        values[first..].fill(0.0);
    }
    let weights = Weights::new(with.graph(), tensors).unwrap();
    let without = Model::new(mixing(4), weights, TrainingFacts::default()).unwrap();
    let error =
        max_error(&run(&without, &gbuffer, (1, Level::best())), &run(&with, &gbuffer, (1, Level::best())));
    assert!(error > 0.005, "{error}");
}

#[test]
fn smoothing_changes_what_a_network_adds_and_settles_the_search() {
    let gbuffer = behind_bars(&waves(Size::px(70, 33)));
    let [plain, smooth] =
        [surveying(4), smoothing(4)].map(|config| run(&model(config, 1), &gbuffer, (1, Level::best())));
    assert!(max_error(&plain, &smooth) > 0.05, "nothing is smoothed");
    let nothing = |config: ModelConfig| {
        let graph = Graph::new(&config).unwrap();
        let mut tensors = Weights::init(&graph, 1).tensors().clone();
        tensors.values_mut().for_each(|tensor| tensor.values.fill(0.0));
        let weights = Weights::new(&graph, tensors).unwrap();
        let model = Model::new(config, weights, TrainingFacts::default()).unwrap();
        run(&model, &gbuffer, (2, Level::best()))
    };
    // What a search found moves by at most the largest d (1 - (d / 0.02)²): 0.02 times 2 / sqrt(27).
    let settled = max_error(&nothing(smoothing(4)), &nothing(surveying(4)));
    assert!((0.004..0.00770).contains(&settled), "{settled}");
}

#[test]
fn baselines() {
    check(ModelConfig::deep_shading(), Size::px(70, 33));
    check(ModelConfig::deep_ao(), Size::px(45, 20));
}

#[test]
fn every_patch_and_kernel() {
    for patch in [1, 2, 4, 8] {
        for kernel in KERNELS {
            check(small(Features::normal_projected_radius(), patch, kernel), Size::px(75, 21));
        }
    }
}

#[test]
fn any_depth_and_any_width() {
    for (encoder, decoder) in [
        (vec![7], vec![]),
        (vec![1, 1], vec![1]),
        (vec![16, 33, 20], vec![50, 31]),
        (vec![3, 4, 5, 6, 7], vec![8, 9, 10, 11]),
    ] {
        check(ModelConfig { encoder, decoder, ..ModelConfig::paper() }, Size::px(40, 40));
    }
}

#[test]
fn any_size() {
    for size in [
        Size::px(1, 1),
        Size::px(2, 1),
        Size::px(1, 2),
        Size::px(3, 5),
        Size::px(8, 8),
        Size::px(31, 33),
        Size::px(33, 31),
        Size::px(129, 7),
        Size::px(5, 200),
        Size::px(4001, 17),
    ] {
        check(small(Features::normal_projected_radius(), 4, KernelWeights::Linear), size);
    }
    for size in [Size::px(1, 1), Size::px(65, 3)] {
        check(small(Features::normal(), 1, KernelWeights::Linear), size);
        check(small(Features::normal(), 8, KernelWeights::Off), size);
    }
}

#[test]
fn an_observer_sees_every_step_in_order_and_changes_nothing() {
    let model = model(small(Features::normal_projected_radius(), 4, KernelWeights::Linear), 1);
    let gbuffer = frame(Size::px(50, 30), 2);
    let mut session = Session::new(&model, Size::px(50, 30), 2).unwrap();
    let mut image = AoImage::open(Size::px(50, 30));
    let mut seen = Vec::new();
    session.run_observed(&gbuffer, params(), &mut image, &mut |step| seen.push(step)).unwrap();
    assert_eq!(seen, (0..session.plan().steps.len()).collect::<Vec<_>>());
    assert_eq!(image, run(&model, &gbuffer, (2, Level::best())));
    let mut small = AoImage::open(Size::px(3, 3));
    assert!(session.run_observed(&gbuffer, params(), &mut small, &mut |_| panic!("a step")).is_err());
}

/// Root mean square of the differences between precisions and f32 over the frame. Measured: 0.0092 in bf16 and 0.0084 in
/// integers at most, both of `paper`; 0.0012 and 0.0055 of the others.
const PRECISION_TOLERANCE: f64 = 0.015;

#[test]
fn shipped_networks_say_the_same_in_every_precision() {
    // Surfaces: integers cover the values that calibration met, which noise exceeds.
    let gbuffer = waves(Size::px(300, 170));
    for (name, bytes) in aonet::net::shipped::ALL {
        let model = Model::from_bytes(bytes).unwrap();
        let image = |precision| {
            let options = Options { threads: 2, precision, ..Options::default() };
            let mut session = Session::with_options(&model, Size::px(300, 170), options).unwrap();
            let mut image = AoImage::open(Size::px(300, 170));
            session.run(&gbuffer, params(), &mut image).unwrap();
            image
        };
        let exact = image(Precision::F32);
        for precision in Precision::available().filter(|p| *p != Precision::F32) {
            let rounded = image(precision);
            let pairs = exact.visibility().iter().zip(rounded.visibility());
            let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let rms = (squares / exact.visibility().len() as f64).sqrt();
            assert!(rms > 0.0 && rms <= PRECISION_TOLERANCE, "{name}, {precision}: {rms}");
        }
    }
}

#[test]
fn calibration_measures_what_convolutions_read() {
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 1);
    let (first, second) = (frame(Size::px(90, 50), 1), frame(Size::px(90, 50), 2));
    let mut image = AoImage::open(Size::px(90, 50));
    let mut measure = |frames: &[&GBuffer], level| {
        let mut ranges = Ranges::new();
        let options = Options { threads: 2, level, precision: Precision::F32 };
        let mut session = Session::with_options(&model, Size::px(90, 50), options).unwrap();
        for gbuffer in frames {
            session.calibrate(gbuffer, params(), &mut image, &mut ranges).unwrap();
        }
        ranges
    };
    let (one, both) = (measure(&[&first], Level::Portable), measure(&[&first, &second], Level::best()));
    let convolutions = model.graph().params().into_iter().filter(|p| p.name.ends_with(".weight"));
    let mut expected: Vec<_> = convolutions
        .filter(|p| p.name != "head.weight")
        .map(|p| (p.name.replace(".weight", ""), p.shape[0]))
        .collect();
    expected.push(("features".into(), 3 * 4 * 4));
    expected.sort();
    let found: Vec<_> = both.iter().map(|(name, channels)| (name.clone(), channels.len())).collect();
    assert_eq!(found, expected);
    for (name, channels) in &both {
        for ([least, most], [inner_least, inner_most]) in channels.iter().zip(&one[name]) {
            assert!(least <= &(inner_least + 1e-5) && most >= &(inner_most - 1e-5) && least < most, "{name}");
        }
    }
    let partitioned = [&first, &second]
        .map(|gbuffer| naive::patch_partition(&naive::inputs(&model, gbuffer, params()).features, 4));
    for (c, [least, most]) in both["features"].iter().enumerate() {
        let of_channel = partitioned.iter().flat_map(|p| p.values.chunks_exact(p.height * p.width).nth(c));
        let values: Vec<f32> = of_channel.flatten().copied().collect();
        let expected =
            values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
        assert_eq!([*least, *most], expected, "channel {c}");
    }

    let calibrated = model.clone().with_ranges(both).unwrap();
    let bytes = calibrated.to_bytes(aonet::net::WeightFormat::F32).unwrap();
    assert_eq!(Model::from_bytes(&bytes).unwrap(), calibrated);
    assert!(model.clone().with_ranges(Ranges::from([("x".into(), vec![[1.0, 0.0]])])).is_err());
    assert!(model.clone().with_ranges(Ranges::from([("x".into(), vec![[f32::NAN, 0.0]])])).is_err());
}

#[test]
fn a_precision_without_instructions_or_ranges_is_an_error() {
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 1);
    let error = |level, precision| {
        let options = Options { threads: 1, level, precision };
        Session::with_options(&model, Size::px(20, 10), options).unwrap_err().to_string()
    };
    for precision in [Precision::Bf16, Precision::Int8] {
        let error = error(Level::Portable, precision);
        assert!(error.contains(&precision.to_string()) && error.contains("Portable"), "{error}");
    }
    if Precision::available().any(|p| p == Precision::Int8) {
        let error = error(Level::best(), Precision::Int8);
        assert!(error.contains("ranges") && error.contains("calibrated"), "{error}");
    }
    assert!("f16".parse::<Precision>().unwrap_err().to_string().contains("f16"));
    assert_eq!("bf16".parse::<Precision>().unwrap(), Precision::Bf16);
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let model = model(ModelConfig::correcting(), 5);
    let gbuffer = frame(Size::px(700, 500), 6);
    for level in Level::available() {
        let one = run(&model, &gbuffer, (1, level));
        for threads in [2, 3, 64] {
            assert_eq!(run(&model, &gbuffer, (threads, level)), one, "{level:?}, {threads} threads");
        }
    }
}

#[test]
fn a_shifted_frame_gives_a_shifted_image() {
    // Winograd's squares of 4x4 cells, at stride 8, move as a whole: others round in other places.
    let (small_size, (dx, dy)) = (Size::px(360, 280), (32, 64));
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 7);
    let large = frame(Size::px(small_size.width() + dx, small_size.height() + dy), 8);
    let crop = |x0: usize, y0: usize| {
        let index = |i: usize| (i / small_size.width() + y0) * large.width() + i % small_size.width() + x0;
        let pixels = 0..small_size.pixels();
        let depth = pixels.clone().map(|i| large.depth()[index(i)]).collect::<Vec<_>>();
        let normal = pixels.map(|i| large.normal()[index(i)]).collect::<Vec<_>>();
        GBuffer::new(camera(small_size), depth, normal).unwrap()
    };
    let [a, b] = [(0, 0), (dx, dy)].map(|(x, y)| run(&model, &crop(x, y), (2, Level::best())));
    // Two convolutions at stride 8, two up and two down at stride 4, pooling, upsampling and the kernel's
    // window reach less than 64 pixels.
    let border = 64;
    let mut seen = 0;
    for y in border..small_size.height() - border - dy {
        for x in border..small_size.width() - border - dx {
            let at = |image: &AoImage, x: usize, y: usize| image.visibility()[y * small_size.width() + x];
            assert_eq!(at(&a, x + dx, y + dy), at(&b, x, y), "({x}, {y})");
            seen += 1;
        }
    }
    assert!(seen > 10_000);
}

#[test]
fn a_session_keeps_nothing_of_the_last_frame() {
    let model = model(ModelConfig::paper(), 9);
    let frames = [frame(Size::px(90, 50), 10), frame(Size::px(90, 50), 11)];
    let mut session = Session::new(&model, Size::px(90, 50), 2).unwrap();
    let mut image = AoImage::open(Size::px(90, 50));
    for gbuffer in [&frames[0], &frames[1], &frames[0]] {
        session.run(gbuffer, params(), &mut image).unwrap();
        assert_eq!(image, run(&model, gbuffer, (1, Level::best())));
    }
}

#[test]
fn background_is_open_and_the_rest_is_clamped() {
    let config = small(Features::normal(), 4, KernelWeights::Off);
    let mut tensors = model(config.clone(), 12).weights().tensors().clone();
    tensors.get_mut("head.weight").unwrap().values.iter_mut().for_each(|v| *v *= 1e4);
    let graph = aonet::internals::graph::Graph::new(&config).unwrap();
    let weights = aonet::internals::weights::Weights::new(&graph, tensors).unwrap();
    let model = Model::new(config, weights, Default::default()).unwrap();
    let gbuffer = frame(Size::px(60, 40), 13);
    for level in Level::available() {
        let image = run(&model, &gbuffer, (1, level));
        let v = image.visibility();
        assert!(v.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!((0..v.len()).all(|i| gbuffer.is_foreground(i) || v[i] == 1.0));
        let foreground = |value| (0..v.len()).any(|i| gbuffer.is_foreground(i) && v[i] == value);
        assert!(foreground(0.0) && foreground(1.0), "the test reaches both ends");
    }
}

#[test]
fn wrong_sizes_and_no_threads_are_errors() {
    let model = model(small(Features::normal(), 4, KernelWeights::Linear), 14);
    let mut session = Session::new(&model, Size::px(20, 10), 1).unwrap();
    let (good, bad) = (frame(Size::px(20, 10), 1), frame(Size::px(10, 20), 1));
    let mut image = AoImage::open(Size::px(20, 10));
    let error = session.run(&bad, params(), &mut image).unwrap_err().to_string();
    assert!(error.contains("20x10") && error.contains("10x20"), "{error}");
    let mut wrong = AoImage::open(Size::px(10, 10));
    assert!(session.run(&good, params(), &mut wrong).is_err());
    assert!(Session::new(&model, Size::px(20, 10), 0).is_err());
    assert!(Size::new(0, 10).is_err());
}

#[test]
#[should_panic(expected = "tolerance")]
fn a_difference_is_noticed() {
    let image = AoImage::new(Size::px(3, 1), vec![0.1, 0.5, 0.9]).unwrap();
    let mut other = image.clone();
    other.visibility_mut()[2] += 2.0 * TOLERANCE;
    assert_close(&image, &other, (TOLERANCE, "perturbed"));
}
