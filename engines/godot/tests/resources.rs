//! Resources are what Godot reads: SPIR-V that a validator accepts, in the places that the list names.

use aonet::gpu::{DepthEncoding, NormalEncoding, Precision, ProgramOptions, TextureEncoding};
use aonet::net::{Model, gpu::Network, shipped};
use aonet::search::{Classic, gpu::Method};
use aonet_godot::{Stage, compile, resource};
use base64::Engine;
use serde_json::Value;
use std::io::Write;
use std::process::{Command, Stdio};

const TEXTURES: TextureEncoding = TextureEncoding {
    normals: NormalEncoding::Unorm,
    normal_space: aonet::gpu::NormalSpace::View,
    depth: DepthEncoding::Reversed,
    layers: aonet::gpu::Layers::One,
};

fn network(name: &str) -> Model {
    let (_, bytes) =
        shipped::ALL.into_iter().find(|(known, _)| *known == name).expect("a network or a classic method");
    Model::from_bytes(bytes).unwrap()
}

/// The two files of a program.
fn files(name: &str, textures: TextureEncoding, precision: Precision) -> (Vec<u8>, Vec<u8>) {
    let template = match Classic::named(name) {
        Ok(method) => Method::new(&method, textures).unwrap().template().unwrap(),
        Err(_) => {
            let model = network(name);
            let options = ProgramOptions { textures, precision, ..Default::default() };
            Network::new(&model, options).unwrap().template().unwrap()
        }
    };
    let bytes = template.to_bytes().unwrap();
    (bytes.json, bytes.blob)
}

/// List and block of a resource's text.
fn parsed(text: &str) -> (Value, Vec<u8>) {
    let field = |begin: &str, end: &str| {
        let from = text.find(begin).unwrap() + begin.len();
        text[from..][..text[from..].find(end).unwrap()].to_owned()
    };
    let document = field("document = \"", "\"\nblock").replace("\\\"", "\"").replace("\\\\", "\\");
    let block = base64::engine::general_purpose::STANDARD.decode(field("PackedByteArray(\"", "\")")).unwrap();
    (serde_json::from_str(&document).unwrap(), block)
}

fn slice<'a>(block: &'a [u8], place: &Value) -> &'a [u8] {
    let number = |name: &str| place[name].as_u64().unwrap() as usize;
    &block[number("offset")..][..number("bytes")]
}

/// What the validator of SPIR-V for Vulkan says to a module: nothing, or what is wrong.
fn validated(module: &[u8]) -> Result<(), String> {
    let mut validator = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.1", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("spirv-val of Debian's package spirv-tools");
    validator.stdin.take().unwrap().write_all(module).unwrap();
    let output = validator.wait_with_output().unwrap();
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
fn shaders_of_every_method_are_valid() {
    let half = [("fast", Precision::F16), ("high", Precision::F16)];
    let single = [
        "fast",
        "balanced",
        "high",
        "paper",
        "gtao:tuned",
        "agtao:tuned",
        "vbao",
        "arcs:tuned",
        "ssao",
        "hbao",
    ];
    for (name, precision) in single.map(|name| (name, Precision::F32)).into_iter().chain(half) {
        let (json, block) = files(name, TEXTURES, precision);
        let (list, resource_block) = parsed(&resource(&json, &block).unwrap());
        assert_eq!(resource_block[..block.len()], block, "weights stay where they are");
        let shaders = list["shaders"].as_array().unwrap();
        let mut end = block.len();
        for (index, stages) in shaders.iter().enumerate() {
            let drawn = list["image"]["shader"] == index;
            let expected: &[&str] = if drawn { &["fragment", "vertex"] } else { &["compute"] };
            let mut found: Vec<_> = stages.as_object().unwrap().iter().collect();
            found.sort_by_key(|(_, place)| place["offset"].as_u64());
            let mut names: Vec<_> = found.iter().map(|(name, _)| name.as_str()).collect();
            names.sort_unstable();
            assert_eq!(names, expected);
            for (stage, place) in found {
                assert_eq!(place["offset"], end, "{name}: parts follow each other");
                let module = slice(&resource_block, place);
                end += module.len();
                validated(module).unwrap_or_else(|e| panic!("{name}, shader {index}, {stage}: {e}"));
                assert!(
                    module.windows(8).any(|w| w == b"main\0\0\0\0"),
                    "Godot looks for an entry point main"
                );
            }
        }
        assert_eq!(end, resource_block.len());
        // Every pass has a shader, and the one that hands visibility over comes last.
        assert_eq!(list["finish"]["shader"], shaders.len() - 1);
        assert!(list.get("choices").is_none() && list["passes"].as_array().unwrap().len() > 1);
    }
}

#[test]
fn the_validator_refuses_what_is_broken() {
    let source = "@compute @workgroup_size(1) fn main() {}";
    let mut words = compile(source, Stage::Compute).unwrap();
    let bytes = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<_>>();
    validated(&bytes(&words)).unwrap();
    // The last instruction ends the function.
    words.pop();
    assert!(validated(&bytes(&words)).is_err());
}

#[test]
fn mistakes_are_errors_that_name_them() {
    let (json, block) = files("fast", TEXTURES, Precision::F32);
    let error = |json: &[u8], block: &[u8]| resource(json, block).map(drop).unwrap_err().to_string();
    assert!(error(&json, &block[4..]).contains("block"));
    assert!(error(b"{}", &block).contains("program"));
    let plain = TextureEncoding { normals: NormalEncoding::Plain, ..TEXTURES };
    let standard = TextureEncoding { depth: DepthEncoding::Standard, ..TEXTURES };
    let two = TextureEncoding { layers: aonet::gpu::Layers::Two, ..TEXTURES };
    for (textures, expected) in [
        (plain, "normals: expected unorm, found \"plain\""),
        (standard, "depth: expected reversed, found \"standard\""),
        (two, "layers: expected one, found \"two\""),
    ] {
        let (json, block) = files("agtao:tuned", textures, Precision::F32);
        let found = error(&json, &block);
        assert!(found.contains(expected), "{found}");
    }
    let broken = String::from_utf8(json).unwrap().replacen("fn main", "fn 1main", 1);
    assert!(error(broken.as_bytes(), &block).contains("expected identifier"));
    assert!(compile("fn", Stage::Compute).is_err());
    let found = compile("@compute @workgroup_size(1) fn main() {}", Stage::Fragment).unwrap_err().to_string();
    assert!(found.contains("fragment"), "{found}");
}
