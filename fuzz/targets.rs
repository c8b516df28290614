//! What the targets do with a file. The test `fuzz_seeds` of `aonet_lab` includes this file and replays the seeds with it.

use aonet::Size;
use aonet::gpu::{Program, Template};
use aonet::net::{Model, ModelConfig, WeightFormat};
use aonet_lab::ao_file::read_ao;
use aonet_lab::dataset::Manifest;
use aonet_lab::frame::{Frame, FrameHints};
use aonet_lab::preset::Preset;
use aonet_lab::train_config::TrainConfig;
use aonet_scene::View;
use aonet_scene::scene::textures::{Image, ImageFile};
use aonet_scene::scene::{MissingNormals, gltf};
use serde::Serialize;
use std::fmt::Debug;
use std::path::Path;

// Three files of `aonet_view`: the whole crate needs wgpu, which takes minutes to build.
#[allow(dead_code, reason = "files of another crate")]
#[path = "../crates/aonet_view/src/renderer/path.rs"]
mod camera_path;
#[allow(dead_code, reason = "files of another crate")]
#[path = "../crates/aonet_view/src/renderer/decode.rs"]
mod decode;
#[allow(dead_code, reason = "files of another crate")]
#[path = "../crates/aonet_view/src/renderer/orbit.rs"]
mod orbit;

/// Reads a file and returns whether it is valid.
///
/// # Panics
/// When a value is not sound, or changes when it is written and read again.
pub type Target = fn(&[u8]) -> bool;

/// All targets that read a file, by name. Their seeds are in `seeds/NAME`.
pub const ALL: [(&str, Target); 11] = [
    ("config", config),
    ("frame", frame),
    ("gltf", gltf),
    ("image", image),
    ("manifest", manifest),
    ("path", path),
    ("preset", preset),
    ("program", program),
    ("training", training),
    ("view", view),
    ("weights", weights),
];

/// Targets that make their own input and have no seeds.
pub const WITHOUT_SEEDS: [&str; 2] = ["api", "gltf_fields"];

/// Whether JSON is read. What was read must be the same after it is written and read again.
fn reads_back<T: Serialize + PartialEq + Debug, E: Debug>(
    bytes: &[u8],
    read: impl Fn(&[u8]) -> Result<T, E>,
) -> bool {
    let Ok(value) = read(bytes) else { return false };
    let again = serde_json::to_vec(&value).expect("what was read is JSON");
    assert_eq!(read(&again).expect("and reads back"), value);
    true
}

/// Configurations of networks.
pub fn config(bytes: &[u8]) -> bool {
    reads_back::<ModelConfig, _>(bytes, |bytes| serde_json::from_slice(bytes))
}

/// Frame files.
pub fn frame(bytes: &[u8]) -> bool {
    let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
    Frame::from_bytes(bytes, &hints).is_ok()
}

/// Scene files, with and without normals to invent.
pub fn gltf(bytes: &[u8]) -> bool {
    let Ok(scene) = gltf::from_bytes(bytes, None, "fuzz", MissingNormals::CREASE) else { return false };
    scene.checked().expect("a loaded scene is sound");
    true
}

/// Side of the square that images are stretched to (px): some have to grow and others to shrink.
const SIDE: u32 = 16;

/// Images of scenes (PNG, JPEG), and AO images (PNG).
pub fn image(bytes: &[u8]) -> bool {
    let ao = read_ao(Path::new("fuzz.png"), bytes);
    if let Ok(ao) = &ao {
        assert!(ao.visibility().iter().all(|v| (0.0..=1.0).contains(v)), "visibility out of range");
    }
    let image = Image { name: "fuzz".into(), file: Ok(ImageFile::Embedded(bytes.into())) };
    let levels = decode::levels(&image, SIDE);
    if let Ok(levels) = &levels {
        decode::size(&image).expect("what is decoded has a size");
        let sides: Vec<_> = levels.iter().map(|level| level.dimensions()).collect();
        assert_eq!(sides, [16, 8, 4, 2, 1].map(|side| (side, side)));
    }
    ao.is_ok() || levels.is_ok()
}

/// Dataset manifests.
pub fn manifest(bytes: &[u8]) -> bool {
    reads_back(bytes, |bytes| Manifest::from_bytes(bytes, Path::new("fuzz/manifest.json")))
}

/// Camera paths, replayed from before their start until after their end.
pub fn path(bytes: &[u8]) -> bool {
    let Ok(path) = camera_path::CameraPath::from_json(bytes) else { return false };
    let again = camera_path::CameraPath::from_json(path.to_json().as_bytes());
    assert_eq!(again.expect("what was read can be written"), path);
    let (first, last) = path.span();
    for share in [-0.5, 0.0, 0.3, 0.5, 0.9, 1.0, 1.5] {
        let orbit = path.at(first + share * (last - first)).expect("a path that was read has keys");
        assert!(orbit.target.is_finite() && orbit.eye().is_finite(), "{orbit:?}");
    }
    true
}

/// Presets of classic methods.
pub fn preset(bytes: &[u8]) -> bool {
    reads_back(bytes, |bytes| Preset::from_bytes(bytes, Path::new("fuzz/preset.json")))
}

/// Program files of one size and of every size: JSON, a zero, and the block of bytes.
pub fn program(bytes: &[u8]) -> bool {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    let (json, blob) = (&bytes[..end], bytes.get(end + 1..).unwrap_or_default());
    let program = Program::from_bytes(json, blob);
    if let Ok(program) = &program {
        let again = program.to_bytes().expect("a program that was read can be written");
        let read = Program::from_bytes(&again.json, &again.blob).expect("and read back");
        assert_eq!(read.to_bytes().expect("as before"), again);
    }
    let template = Template::from_bytes(json, blob);
    if let Ok(template) = &template {
        let again = template.to_bytes().expect("a template that was read can be written");
        let read = Template::from_bytes(&again.json, &again.blob).expect("and read back");
        assert_eq!(read.to_bytes().expect("as before"), again);
        for (width, height) in [(1, 1), (17, 3), (1920, 1080), (65_535, 65_535)] {
            if let Ok(size) = Size::new(width, height) {
                let _ = template.at(size);
            }
        }
    }
    program.is_ok() || template.is_ok()
}

/// Configurations of training.
pub fn training(bytes: &[u8]) -> bool {
    reads_back(bytes, |bytes| TrainConfig::from_bytes(bytes, Path::new("fuzz/training.json")))
}

/// Views, and the cameras they make.
pub fn view(bytes: &[u8]) -> bool {
    reads_back(bytes, |bytes| View::from_bytes(bytes, Path::new("fuzz/view.json")))
}

/// Weights files.
pub fn weights(bytes: &[u8]) -> bool {
    let Ok(model) = Model::from_bytes(bytes) else { return false };
    let again = model.to_bytes(WeightFormat::F32).expect("a loaded model can be written");
    assert_eq!(Model::from_bytes(&again).expect("and read back"), model);
    true
}
