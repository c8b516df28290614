//! ONNX files in ONNX Runtime against the CPU session.
//!
//! Needs `python3` with `onnx` and `onnxruntime`; without them the test reports that it did not run, or fails if
//! `AONET_REQUIRE_ONNX` is set.

#[path = "../../aonet/tests/common/mod.rs"]
mod common;

use aonet::net::cpu::Session;
use aonet::net::{Channel, Features, KernelWeights, Model, ModelConfig, Output, shipped};
use aonet::{AoImage, GBuffer, Size};
use aonet_lab::onnx::{Extent, Form, export, inputs, npy};
use common::{frame, model, params, seeing, small, spread};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Largest difference between the two runtimes that is allowed. Measured: 1e-6 over all cases here, from the order of sums.
const TOLERANCE: f32 = 1e-5;

/// A file, the frame that it runs on, and what a session makes of the frame.
struct Case {
    name: String,
    extent: Extent,
    gbuffer: GBuffer<'static>,
    expected: AoImage,
}

fn write_case(folder: &Path, model: &Model, (name, form, extent): (String, Form, Extent)) -> Case {
    let size = match extent {
        Extent::Dynamic => Size::px(75, 41),
        Extent::Fixed { width, height } => Size::px(width, height),
    };
    let gbuffer = frame(size, 2);
    let mut expected = AoImage::open(gbuffer.size());
    // A file leaves out the filter over the correction.
    let config = ModelConfig { smooth: false, ..model.config().clone() };
    let plain = Model::new(config, model.weights().clone(), model.facts().clone()).unwrap();
    Session::new(&plain, gbuffer.window(), 1).unwrap().run(&gbuffer, params(), &mut expected).unwrap();
    assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {name}");
    for (input, planes) in inputs(model, extent, (&gbuffer, params())).unwrap() {
        std::fs::write(folder.join(format!("{name}.{input}.npy")), npy(&planes)).unwrap();
    }
    std::fs::write(folder.join(format!("{name}.onnx")), export(model, form, extent).unwrap().bytes).unwrap();
    Case { name, extent, gbuffer, expected }
}

/// Largest difference on the foreground.
fn error(folder: &Path, model: &Model, case: &Case) -> f32 {
    let bytes = std::fs::read(folder.join(format!("{}.visibility", case.name))).unwrap();
    let found: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    let width = case.gbuffer.width();
    let row = inputs(model, case.extent, (&case.gbuffer, params())).unwrap()[0].1.width;
    let foreground = (0..width * case.gbuffer.height()).filter(|&i| case.gbuffer.is_foreground(i));
    foreground
        .map(|i| (found[i / width * row + i % width] - case.expected.visibility()[i]).abs())
        .fold(0.0, f32::max)
}

/// The trained network of a table's row.
fn trained(row: &str) -> Model {
    let rows = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/models/rows");
    Model::from_bytes(&std::fs::read(rows.join(format!("{row}.safetensors"))).unwrap()).unwrap()
}

fn models() -> Vec<(&'static str, Model)> {
    let correction = |patch, kernel| {
        let output = Output::Correction;
        ModelConfig { output, ..small(Features::normal_radius_horizon(), patch, kernel) }
    };
    let middle = Features::normal().with(Channel::HorizonOcclusion).with(Channel::ProjectedRadius);
    let full_kernels = |weights| ModelConfig { kernel: weights, ..ModelConfig::full_resolution() };
    vec![
        ("balanced", Model::from_bytes(shipped::BALANCED).unwrap()),
        ("high", Model::from_bytes(shipped::HIGH).unwrap()),
        ("paper", Model::from_bytes(shipped::PAPER).unwrap()),
        ("deep_ao", trained("deep_ao")),
        ("deep_shading", trained("deep_shading")),
        ("full_linear", model(full_kernels(KernelWeights::Linear), 1)),
        ("full_off", model(full_kernels(KernelWeights::Off), 1)),
        ("patch_softmax", model(small(Features::normal_projected_radius(), 4, KernelWeights::Softmax), 1)),
        ("full_softmax", model(small(Features::normal(), 1, KernelWeights::Softmax), 1)),
        ("patch2_linear", model(small(Features::normal_depth(), 2, KernelWeights::Linear), 1)),
        ("patch8_correction", model(correction(8, KernelWeights::Off), 1)),
        ("patch2_linear_correction", model(correction(2, KernelWeights::Linear), 1)),
        (
            "unseen_search",
            model(ModelConfig { features: Features::normal(), ..correction(4, KernelWeights::Off) }, 1),
        ),
        ("search_in_the_middle", model(seeing(middle), 1)),
        ("no_skips", model(ModelConfig { skips: aonet::net::Skips::None, ..ModelConfig::paper() }, 1)),
    ]
}

/// Whether ONNX Runtime is available.
fn available() -> bool {
    let import = Command::new("python3").args(["-c", "import onnx, onnxruntime"]).output();
    let found = import.is_ok_and(|output| output.status.success());
    let required = std::env::var_os("AONET_REQUIRE_ONNX").is_some();
    assert!(found || !required, "AONET_REQUIRE_ONNX is set, but python3 has no onnx and onnxruntime");
    found
}

#[test]
fn onnx_runtime_agrees_with_the_session() {
    if !available() {
        eprintln!("skipped: python3 has no onnx and onnxruntime");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let models = models();
    let mut cases = Vec::new();
    for (name, model) in &models {
        for form in [Form::Plain, Form::Tuned] {
            let aligned = Extent::Fixed { width: 128, height: 64 };
            for extent in [Extent::Dynamic, Extent::Fixed { width: 75, height: 41 }, aligned] {
                let case = format!("{name} {form:?} {extent:?}");
                cases.push((model, write_case(folder, model, (case, form, extent))));
            }
        }
    }
    let list: Vec<_> = cases
        .iter()
        .map(|(model, case)| {
            let inputs = inputs(model, case.extent, (&case.gbuffer, params())).unwrap();
            let shapes: BTreeMap<_, _> =
                inputs.iter().map(|(name, p)| (*name, [1, p.channels, p.height, p.width])).collect();
            serde_json::json!({ "name": case.name, "shapes": shapes })
        })
        .collect();
    std::fs::write(folder.join("cases.json"), serde_json::to_vec(&list).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scripts/run_onnx.py");
    let output = Command::new("python3").arg(script).arg(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut largest = 0f32;
    for (model, case) in &cases {
        let error = error(folder, model, case);
        eprintln!("{error:.1e} {}", case.name);
        assert!(error <= TOLERANCE, "{}: error {error:e}", case.name);
        largest = largest.max(error);
    }
    assert!(largest > 0.0, "two runtimes never sum in the same order: something was compared with itself");
}
