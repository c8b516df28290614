//! A valid scene file with some numbers of its JSON replaced and bytes of its buffer changed. It reaches code behind the
//! parser, which random damage rarely does.
#![no_main]

use aonet_scene::scene::{MissingNormals, gltf};
use serde_json::{Value, json};

const SEED: &[u8] = include_bytes!("../seeds/gltf/everything.glb");

fn numbers<'a>(value: &'a mut Value, found: &mut Vec<&'a mut Value>) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(|v| numbers(v, found)),
        Value::Object(map) => map.values_mut().for_each(|v| numbers(v, found)),
        Value::Number(_) => found.push(value),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let word = |n: usize| (n as u32).to_le_bytes();
    let head = [b"glTF".to_vec(), word(2).to_vec(), word(28 + json.len() + bin.len()).to_vec()];
    let chunks = [word(json.len()).to_vec(), b"JSON".to_vec(), json.to_vec(), word(bin.len()).to_vec()];
    [head.concat(), chunks.concat(), b"BIN\0".to_vec(), bin.to_vec()].concat()
}

libfuzzer_sys::fuzz_target!(|change: (Vec<(u8, i16)>, Vec<u8>)| {
    let (fields, flips) = change;
    let length = u32::from_le_bytes([SEED[12], SEED[13], SEED[14], SEED[15]]) as usize;
    let (json, bin) = (&SEED[20..20 + length], &SEED[28 + length..]);
    let mut document: Value = serde_json::from_slice(json).expect("the seed is sound");
    let mut found = Vec::new();
    numbers(&mut document, &mut found);
    let count = found.len();
    for (field, value) in fields {
        *found[usize::from(field) % count] = json!(value);
    }
    let mut bin = bin.to_vec();
    bin.iter_mut().zip(flips).for_each(|(byte, flip)| *byte ^= flip);
    let json = serde_json::to_vec(&document).expect("JSON");
    if let Ok(scene) = gltf::from_bytes(&glb(&json, &bin), None, "fuzz", MissingNormals::CREASE) {
        scene.checked().expect("a loaded scene is sound");
    }
});
