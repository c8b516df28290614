//! Frames of every size: networks against the oracle, methods against themselves with other threads and instructions.
//!
//! The whole range takes minutes: `cargo test --release -p aonet --test sizes -- --ignored`.

mod common;

use aonet::net::cpu::{Options, Precision, Session};
use aonet::net::{Features, KernelWeights, Model, ModelConfig, Output};
use aonet::search::{self, Classic};
use aonet::simd::Level;
use aonet::{AoImage, GBuffer, Size};
use common::{assert_close, frame, mean_error, model, oracle, params, small, waves, weighing_shares};

/// Largest difference between a session and the oracle: `cpu_session.rs` measures 5e-7 without smoothing, 1.5e-5 with it.
const TOLERANCE: f32 = 2e-6;
const SMOOTH_TOLERANCE: f32 = 4e-5;

/// Mean difference between levels of instructions, whose reciprocal roots differ: taps at the edge of a radius or sector flip.
/// Measured: 9e-6.
const LEVEL_TOLERANCE: f32 = 1e-4;

/// A height of 1 to 256 for every width of 1 to 256. 37 has no factor in common with 256, so every height comes once.
fn sizes() -> impl Iterator<Item = Size> {
    (1..=256).map(|width| Size::px(width, width * 37 % 256 + 1))
}

/// A small network that corrects a search, weighs neighbours, and smooths what it adds.
fn correcting() -> ModelConfig {
    ModelConfig {
        output: Output::Correction,
        neighbours: vec![1, 3],
        smooth: true,
        ..small(Features::normal_radius_horizon(), 4, KernelWeights::Off)
    }
}

/// One of three networks, so that each sees sizes of every remainder modulo a power of 2.
fn network(size: Size) -> Model {
    let config = match size.width() % 3 {
        0 => correcting(),
        1 => weighing_shares(2),
        _ => small(Features::normal_depth_normalized(), 1, KernelWeights::Softmax),
    };
    model(config, 1)
}

fn run(model: &Model, gbuffer: &GBuffer, threads: usize, level: Level) -> AoImage {
    let options = Options { threads, level, precision: Precision::F32 };
    let mut session = Session::with_options(model, gbuffer.window(), options).unwrap();
    let mut image = AoImage::open(gbuffer.size());
    session.run(gbuffer, params(), &mut image).unwrap();
    image
}

fn run_classic(method: &Classic, gbuffer: &GBuffer, threads: usize, level: Level) -> AoImage {
    let options = search::Options { threads, level };
    let mut session = search::Session::new(method, gbuffer.window(), options).unwrap();
    let mut image = AoImage::open(gbuffer.size());
    session.run(gbuffer, params(), &mut image).unwrap();
    image
}

fn check(size: Size) {
    let gbuffer = frame(size, 2);
    let (model, best) = (network(size), Level::best());
    let image = run(&model, &gbuffer, 2, best);
    let tolerance = if model.config().smooth { SMOOTH_TOLERANCE } else { TOLERANCE };
    assert_close(&image, &oracle(&model, &gbuffer, params()), (tolerance, &format!("network at {size:?}")));
    for method in Classic::all() {
        let image = run_classic(&method, &gbuffer, 3, best);
        let inside = |v: &f32| (0.0..=1.0).contains(v);
        assert!(image.visibility().iter().all(inside), "{} at {size:?}: out of range", method.name());
        assert_eq!(image, run_classic(&method, &gbuffer, 1, best), "{} at {size:?}: threads", method.name());
    }
}

#[test]
fn small_sizes() {
    sizes().take(20).for_each(check);
    for (width, height) in [(1, 1), (1, 64), (64, 1), (255, 3)] {
        check(Size::px(width, height));
    }
}

#[test]
#[ignore = "takes minutes"]
fn all_sizes() {
    sizes().skip(20).for_each(check);
}

/// No oracle finishes these; the levels of instructions do, apart from each other.
fn check_levels(size: Size, methods: &[&str]) {
    let gbuffer = waves(size);
    let network = model(correcting(), 1);
    let expected = run(&network, &gbuffer, 2, Level::best());
    assert!(common::spread(&expected, &gbuffer) > 0.05, "nothing to see at {size:?}");
    for level in Level::available() {
        let off = mean_error(&run(&network, &gbuffer, 3, level), &expected);
        assert!(off <= LEVEL_TOLERANCE, "network at {size:?}, {level:?}: {off:e}");
    }
    for method in methods.iter().map(|name| Classic::named(name).unwrap()) {
        let expected = run_classic(&method, &gbuffer, 2, Level::best());
        for level in Level::available() {
            let off = mean_error(&run_classic(&method, &gbuffer, 3, level), &expected);
            assert!(off <= LEVEL_TOLERANCE, "{} at {size:?}, {level:?}: {off:e}", method.name());
        }
    }
}

#[test]
fn long_strips() {
    check_levels(Size::px(4001, 17), &["agtao", "arcs", "gtao"]);
    check_levels(Size::px(17, 4001), &["agtao", "arcs", "gtao"]);
}

#[test]
#[ignore = "needs 4 GB and takes minutes"]
fn frames_of_8k() {
    check_levels(Size::px(8192, 4320), &["agtao"]);
}
