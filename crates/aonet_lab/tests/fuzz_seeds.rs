//! Replays the fuzzers' seeds and findings (`fuzz/seeds`): files named `crash-*` once broke a
//! reader, all others are valid.

use aonet::gpu::{Describe, TextureEncoding};
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{
    Arch, Features, KernelWeights, Model, ModelConfig, Output, Skips, TrainingFacts, WeightFormat,
};
use aonet::search::Classic;
use aonet::search::gpu::Method;
use aonet_lab::dataset::{DatasetParams, DatasetPlan, FORMAT, Preset};
use aonet_lab::frame::Frame;
use aonet_lab::train_config::{LossConfig, TrainConfig};
use aonet_scene::View;
use aonet_scene::scene::procedural::Kind;
use aonet_scene::staging::{SceneSpec, SceneSplit};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

// The same code as the fuzzers run.
#[allow(unreachable_pub, reason = "a library of the fuzzers")]
#[path = "../../../fuzz/targets.rs"]
mod targets;

fn fuzz() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fuzz")
}

fn folder(target: &str) -> PathBuf {
    fuzz().join("seeds").join(target)
}

/// The names of what is in a folder, without extensions, in order.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut names: Vec<_> =
        entries.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn seeds_are_read() {
    for (target, reads) in targets::ALL {
        let mut sound = 0;
        for entry in std::fs::read_dir(folder(target)).unwrap() {
            let path = entry.unwrap().path();
            // Shown when a target panics.
            println!("{}", path.display());
            let reads = reads(&std::fs::read(&path).unwrap());
            if !path.file_name().unwrap().to_string_lossy().starts_with("crash-") {
                assert!(reads, "{}", path.display());
                sound += 1;
            }
        }
        assert!(sound > 0, "no seeds for {target}");
    }
}

#[test]
fn every_target_is_replayed() {
    let read = targets::ALL.map(|(name, _)| name.to_owned());
    assert_eq!(names(&fuzz().join("seeds")), read, "folders of seeds");
    let mut all = [&read[..], &targets::WITHOUT_SEEDS.map(str::to_owned)].concat();
    all.sort();
    assert_eq!(names(&fuzz().join("fuzz_targets")), all, "targets");
    let run = std::fs::read_to_string(fuzz().join("run")).unwrap();
    assert!(run.contains(&format!("targets=({})", all.join(" "))), "fuzz/run runs {}", all.join(" "));
}

/// Programs of a few numbers: one of one size, and one of every size.
fn write_programs() {
    let method = Classic::named("gtao").unwrap();
    let method = Method::new(&method, TextureEncoding::default()).unwrap();
    let shader = "@compute @workgroup_size(1) fn main() {}";
    let passes = |workgroups: Value| {
        let bindings = json!([{"uniform": 0}, {"read": 1}, {"write": 2}]);
        json!([{"label": "sum", "sees_frame": true, "bindings": bindings, "shader": 0, "workgroups": workgroups}])
    };
    let small = |json: &[u8], changes: Value, blob: &[u8]| {
        let mut document: Value = serde_json::from_slice(json).unwrap();
        let fields = document.as_object_mut().unwrap();
        fields.extend(changes.as_object().unwrap().clone());
        [document.to_string().as_bytes(), b"\0", blob].concat()
    };
    let image = json!({"shader": 0, "bindings": [{"read": 2}]});
    let program = method.program(aonet::Size::px(4, 3)).unwrap().to_bytes().unwrap();
    let changes = json!({
        "blob_bytes": 12,
        "buffers": [
            {"label": "size", "bytes": 8, "usage": "uniform", "contents": {"offset": 0, "bytes": 8}},
            {"label": "weights", "bytes": 4, "usage": "storage", "contents": {"offset": 8, "bytes": 4}},
            {"label": "found", "bytes": 48, "usage": "storage", "cleared": true},
        ],
        "shaders": [shader], "passes": passes(json!([1, 2, 3])), "image": image,
    });
    let blob: Vec<u8> = (1..=12).collect();
    std::fs::write(folder("program").join("one_size"), small(&program.json, changes, &blob)).unwrap();
    let template = method.template().unwrap().to_bytes().unwrap();
    let mut passes = passes(json!([]));
    let pass = passes[0].as_object_mut().unwrap();
    pass.retain(|name, _| !["shader", "workgroups"].contains(&name.as_str()));
    let sizes = json!([{"div_ceil": ["width", 8]}, {"max": ["height", 2]}, 1]);
    pass.insert(
        "variants".into(),
        json!([{"shader": 0, "workgroups": sizes}, {"shader": 0, "workgroups": [1, 1, 1]}]),
    );
    let changes = json!({
        "blob": {"bytes": 8},
        "buffers": [
            {"label": "size", "bytes": 8, "usage": "uniform", "contents": {"numbers": ["width", {"add": ["height", 1]}]}},
            {"label": "weights", "bytes": {"mul": [2, "real_bytes"]}, "usage": "storage",
                "contents": {"reals": {"offset": 0, "bytes": 8}}},
            {"label": "found", "bytes": {"mul": [{"mul": ["width", "height"]}, 4]}, "usage": "storage"},
        ],
        "shaders": [shader], "passes": passes, "image": image,
    });
    std::fs::write(folder("program").join("every_size"), small(&template.json, changes, &blob[..8])).unwrap();
}

#[test]
#[ignore = "writes fuzz/seeds"]
fn write_fuzz_seeds() {
    let text = r#"{"eye":[0,1,3],"target":[0,0,0],"up":[0,1,0],"fov_y_deg":47,"width":3,"height":2,"near":0.05,"far":50,"radius":0.7}"#;
    std::fs::write(folder("view").join("perspective.json"), text).unwrap();
    let orthographic = text.replace("fov_y_deg", "ortho_height");
    std::fs::write(folder("view").join("orthographic.json"), orthographic).unwrap();
    let view: View = serde_json::from_str(text).unwrap();
    let scenes = vec![SceneSpec::procedural(Kind::Hall, 7, SceneSplit::Train)];
    let mut recipe = DatasetParams::preset(Preset::AnyRadius);
    recipe.frames = recipe.frames.kept(|split| scenes.iter().any(|s| split.takes(s.split)));
    let plan = DatasetPlan::new(recipe, scenes).unwrap();
    let mut manifest = serde_json::to_value(plan).unwrap();
    manifest["format"] = json!(FORMAT);
    manifest["tool"] = json!("aonet");
    manifest["shard"] = json!({"index": 1, "count": 2});
    manifest["frames"] = json!([{"file": "frames/0.exr", "scene": "hall_7", "index": 0, "split": "train",
        "view": view, "radius": 0.7, "spp": 64, "seed": 1}]);
    std::fs::write(folder("manifest").join("one_frame.json"), manifest.to_string()).unwrap();
    let depth = vec![1.0, 2.0, f32::INFINITY, 4.0, 5.0, 6.0];
    let normal = depth.iter().map(|d: &f32| if d.is_finite() { [0.0, 0.0, 1.0] } else { [0.0; 3] });
    let gbuffer =
        aonet::GBuffer::new(view.camera().unwrap(), depth.clone(), normal.collect::<Vec<_>>()).unwrap();
    let ao = aonet::AoImage::new(aonet::Size::px(3, 2), vec![0.5, 0.25, 1.0, 0.0, 1.0, 0.75]).unwrap();
    let geo_normal = Some(gbuffer.normal().to_vec());
    let frame = Frame { gbuffer, geo_normal, ao: Some(ao), radius: Some(0.7), view: Some(view) };
    std::fs::write(folder("frame").join("all_channels.exr"), frame.to_bytes().unwrap()).unwrap();
    for (name, method) in ["gtao:tuned", "hbao:tuned"].map(|name| (name, Classic::named(name).unwrap())) {
        let preset = aonet_lab::preset::Preset { method, command: "aonet tune".into(), frames: "8".into() };
        preset.save(&folder("preset").join(name.replace(":tuned", ".json"))).unwrap();
    }
    for (name, config) in [("paper", ModelConfig::paper()), ("balanced", ModelConfig::balanced())] {
        let path = folder("config").join(name).with_extension("json");
        std::fs::write(path, serde_json::to_vec(&config).unwrap()).unwrap();
    }
    let key = |seconds: f32, x: f32| json!({"seconds": seconds, "eye": [x, 1.0, 3.0], "target": [0, 0, 0]});
    for (name, keys) in
        [("one_key", vec![key(0.0, 0.0)]), ("four_keys", [0.0, 0.5, 2.0, 2.5].map(|x| key(x, x)).into())]
    {
        let path = folder("path").join(name).with_extension("json");
        std::fs::write(path, json!({"keys": keys}).to_string()).unwrap();
    }
    let paper = TrainConfig::paper(ModelConfig::paper());
    let loss = LossConfig { l1: 0.1, ms_ssim: 0.84, ..LossConfig::default() };
    let other = TrainConfig { warm_up: 10, average: 0.9, loss, ..paper.clone() };
    for (name, config) in [("paper", paper), ("other_losses", other)] {
        let path = folder("training").join(name).with_extension("json");
        std::fs::write(path, serde_json::to_vec(&config).unwrap()).unwrap();
    }
    write_programs();
    let config = ModelConfig {
        arch: Arch::AoNet,
        features: Features::normal(),
        patch: 1,
        kernel: KernelWeights::Off,
        output: Output::Visibility,
        search: None,
        survey: None,
        embedding: None,
        encoder: vec![1, 1],
        decoder: vec![1],
        skips: Skips::Concat,
        neighbours: vec![],
        smooth: false,
    };
    let weights = Weights::init(&Graph::new(&config).unwrap(), 1);
    let model = Model::new(config, weights, TrainingFacts::default()).unwrap();
    for (name, precision) in [("f32", WeightFormat::F32), ("f16", WeightFormat::F16)] {
        let path = folder("weights").join(name).with_extension("safetensors");
        std::fs::write(path, model.to_bytes(precision).unwrap()).unwrap();
    }
}
