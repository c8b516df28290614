//! Replays the fuzzers' seeds and findings (`fuzz/seeds`): files named `crash-*` once broke a
//! reader, all others are valid.

use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{
    Arch, Features, KernelWeights, Model, ModelConfig, Output, Skips, TrainingFacts, WeightFormat,
};
use aonet::search::Classic;
use aonet_lab::dataset::{DatasetParams, DatasetPlan, FORMAT, Manifest, Preset};
use aonet_lab::frame::{Frame, FrameHints};
use aonet_scene::View;
use aonet_scene::scene::procedural::Kind;
use aonet_scene::scene::{MissingNormals, gltf};
use aonet_scene::staging::{SceneSpec, SceneSplit};
use serde_json::json;
use std::path::{Path, PathBuf};

fn folder(target: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target)
}

/// Reads every seed of a target; `reads` returns whether the file is valid.
fn replay(target: &str, reads: impl Fn(&[u8]) -> bool) {
    let mut sound = 0;
    for entry in std::fs::read_dir(folder(target)).unwrap() {
        let path = entry.unwrap().path();
        let reads = reads(&std::fs::read(&path).unwrap());
        if !path.file_name().unwrap().to_string_lossy().starts_with("crash-") {
            assert!(reads, "{}", path.display());
            sound += 1;
        }
    }
    assert!(sound > 0, "no seeds for {target}");
}

#[test]
fn gltf_seeds() {
    replay("gltf", |bytes| gltf::from_bytes(bytes, None, "seed", MissingNormals::CREASE).is_ok());
}

#[test]
fn view_seeds() {
    replay("view", |bytes| {
        serde_json::from_slice::<View>(bytes).is_ok_and(|view| view.camera().is_ok() && view.params().is_ok())
    });
}

#[test]
fn frame_seeds() {
    let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
    replay("frame", |bytes| Frame::from_bytes(bytes, &hints).is_ok());
}

#[test]
fn weights_seeds() {
    replay("weights", |bytes| Model::from_bytes(bytes).is_ok());
}

#[test]
fn manifest_seeds() {
    replay("manifest", |bytes| Manifest::from_bytes(bytes, Path::new("manifest.json")).is_ok());
}

#[test]
fn preset_seeds() {
    replay("preset", |bytes| aonet_lab::preset::Preset::from_bytes(bytes, Path::new("preset.json")).is_ok());
}

#[test]
fn config_seeds() {
    replay("config", |bytes| serde_json::from_slice::<ModelConfig>(bytes).is_ok());
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
    let config = ModelConfig {
        arch: Arch::AoNet,
        features: Features::normal(),
        patch: 1,
        kernel: KernelWeights::Off,
        output: Output::Visibility,
        search: None,
        survey: None,
        encoder: vec![1, 1],
        decoder: vec![1],
        skips: Skips::Concat,
    };
    let weights = Weights::init(&Graph::new(&config).unwrap(), 1);
    let model = Model::new(config, weights, TrainingFacts::default()).unwrap();
    for (name, precision) in [("f32", WeightFormat::F32), ("f16", WeightFormat::F16)] {
        let path = folder("weights").join(name).with_extension("safetensors");
        std::fs::write(path, model.to_bytes(precision).unwrap()).unwrap();
    }
}
