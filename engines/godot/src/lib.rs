//! Programs of `aonet export --program` as resources of Godot: one text file with the list of dispatches, the weights and the
//! shaders as SPIR-V.
//!
//! `addons/aonet/aonet_program.gd` reads them. The list is that of docs/program_format.md, except that `shaders` names the parts of
//! the block that hold SPIR-V, `choices` is gone, and `finish` is the shader that hands visibility over to Godot.

mod spirv;

pub use spirv::{Stage, compile};

use base64::Engine;
use serde_json::{Value, json};

/// What has gone wrong, as a sentence.
pub type Error = Box<dyn std::error::Error>;

/// The shader that raises visibility to the power of an effect and writes it where Godot's materials read it.
const FINISH: &str = include_str!("finish.wgsl");

/// The text of a resource from the two files of a program.
///
/// # Errors
/// When they are not a program for frames of any size, or its textures hold something else than Godot's.
pub fn resource(json: &[u8], block: &[u8]) -> Result<String, Error> {
    // The crate checks what refers to what.
    aonet::gpu::Template::from_bytes(json, block)?;
    let mut document: Value = serde_json::from_slice(json)?;
    check(&document)?;
    let mut block = block.to_vec();
    let sources: Vec<String> = serde_json::from_value(document["shaders"].take())?;
    let drawn = document["image"]["shader"].as_u64().map(|index| index as usize);
    let mut shaders = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        let stages: &[Stage] = match drawn == Some(index) {
            true => &[Stage::Vertex, Stage::Fragment],
            false => &[Stage::Compute],
        };
        shaders.push(parts(source, stages, &mut block)?);
    }
    document["finish"] = json!({ "shader": shaders.len() });
    shaders.push(parts(FINISH, &[Stage::Compute], &mut block)?);
    document["shaders"] = shaders.into();
    let fields = document.as_object_mut().expect("a checked program is an object");
    fields.remove("choices");
    fields.remove("blob");
    Ok(text(&document.to_string(), &block))
}

/// Refuses programs for other textures than those of Godot's prepass.
fn check(document: &Value) -> Result<(), Error> {
    for (field, expected) in [("normals", "unorm"), ("normal_space", "view"), ("depth", "reversed")] {
        let found = &document["textures"][field];
        if found != expected {
            return Err(format!("textures: {field}: expected {expected}, found {found}").into());
        }
    }
    match document["textures"].get("layers") {
        None => Ok(()),
        Some(found) => Err(format!("textures: layers: expected one, found {found}").into()),
    }
}

/// Appends the stages of a shader to the block and returns their places by name.
fn parts(source: &str, stages: &[Stage], block: &mut Vec<u8>) -> Result<Value, Error> {
    let mut places = json!({});
    for stage in stages {
        let words = compile(source, *stage)?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        places[stage.name()] = json!({ "offset": block.len(), "bytes": bytes.len() });
        block.extend(bytes);
    }
    Ok(places)
}

/// Godot's text form of a resource with a script.
fn text(document: &str, block: &[u8]) -> String {
    let escaped = document.replace('\\', "\\\\").replace('"', "\\\"");
    let block = base64::engine::general_purpose::STANDARD.encode(block);
    format!(
        "[gd_resource type=\"Resource\" script_class=\"AonetProgram\" format=4]\n\n\
         [ext_resource type=\"Script\" path=\"res://addons/aonet/aonet_program.gd\" id=\"1\"]\n\n\
         [resource]\nscript = ExtResource(\"1\")\ndocument = \"{escaped}\"\nblock = PackedByteArray(\"{block}\")\n"
    )
}
