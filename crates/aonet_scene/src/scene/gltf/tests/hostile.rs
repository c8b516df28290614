//! Damaged and malicious files: an error or a scene, never a panic, never more memory than their length justifies.

use super::builder::{bytes, glb};
use super::*;
use serde_json::{Value, json};

/// A file that uses every structure the loader reads.
fn everything() -> Builder {
    let mut file = Builder::new();
    let position = file.vectors(&TRIANGLE);
    let normal = file.vectors(&[[0.0, 1.0, 0.0]; 3]);
    let delta = file.vectors(&[[0.0, 0.5, 0.0]; 3]);
    let indices = file.indices(&[0, 1, 2]);
    let joints = file.accessor(&[0; 12], 5121, ("VEC4", 3));
    let weights = file.vectors(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    let bind = file.vectors(&[glam::Mat4::IDENTITY.to_cols_array()]);
    let at = file.vectors(&[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    let (rows, values) = (file.view(&[2]), file.view(&bytes(&[0.0, 1.0, 0.0])));
    file.json["accessors"][normal]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": rows, "byteOffset": 0, "componentType": 5121},
        "values": {"bufferView": values, "byteOffset": 0}});
    file.json["bufferViews"][0]["byteStride"] = json!(12);
    let places = file.vectors(&[[0.0, 0.0], [0.5, 0.0], [0.0, 2.0]]);
    let image = file.view(b"an image");
    let image = file.push("images", json!({"bufferView": image, "name": "wood"}));
    let sampler = file.push("samplers", json!({"wrapS": 33071, "wrapT": 33648}));
    let texture = file.push("textures", json!({"source": image, "sampler": sampler}));
    let transform = json!({"offset": [0.5, 0], "rotation": 1, "scale": [2, 2], "texCoord": 0});
    let texture =
        json!({"index": texture, "texCoord": 0, "extensions": {"KHR_texture_transform": transform}});
    let material =
        json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "baseColorTexture": texture}});
    let material = file.push("materials", material);
    let attributes = json!({"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights,
        "TEXCOORD_0": places});
    let mesh = file.mesh(
        attributes,
        json!({"indices": indices, "mode": 4, "targets": [{"POSITION": delta}], "material": material}),
    );
    file.json["meshes"][mesh]["weights"] = json!([0.5]);
    let bare = file.mesh(json!({"POSITION": position}), json!({"indices": indices, "mode": 5}));
    file.push("nodes", json!({"mesh": mesh, "skin": 0, "weights": [0.25]}));
    file.push(
        "nodes",
        json!({"children": [0, 2], "translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, 1, 2]}),
    );
    file.push(
        "nodes",
        json!({"mesh": bare, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": at}}}}),
    );
    file.push("skins", json!({"joints": [1], "inverseBindMatrices": bind}));
    file.push("scenes", json!({"nodes": [1]}));
    file.json["scene"] = json!(0);
    file.json["buffers"] = json!([{"byteLength": file.bin.len()}]);
    file
}

fn attempt(bytes: &[u8]) -> crate::Result<Scene> {
    from_bytes(bytes, None, "test", MissingNormals::CREASE)
}

#[test]
fn the_file_is_sound_before_it_is_damaged() {
    let scene = load(&everything());
    assert_eq!((scene.triangle.len(), scene.textures.image.len()), (3, 1));
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let whole = everything().glb();
    for length in 0..whole.len() {
        assert!(attempt(&whole[..length]).is_err(), "{length}");
        let mut relabelled = whole[..length].to_vec();
        if let Some(field) = relabelled.get_mut(8..12) {
            field.copy_from_slice(&(length as u32).to_le_bytes());
            assert!(attempt(&relabelled).is_err(), "{length}, with its length in the header");
        }
    }
}

/// Paths of all values inside a JSON value.
fn pointers(value: &Value, path: &str, found: &mut Vec<String>) {
    found.push(path.to_owned());
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| pointers(v, &format!("{path}/{i}"), found))
        }
        Value::Object(map) => map.iter().for_each(|(k, v)| pointers(v, &format!("{path}/{k}"), found)),
        _ => {}
    }
}

#[test]
fn any_field_may_hold_anything() {
    let file = everything();
    let mut paths = Vec::new();
    pointers(&file.json, "", &mut paths);
    let replacements = json!([
        0,
        1,
        2,
        3,
        5,
        255,
        u32::MAX,
        1u64 << 32,
        u64::MAX,
        u64::MAX / 12,
        i64::MIN,
        -1,
        1e300,
        -1e-300,
        0.5,
        null,
        true,
        "",
        "VEC3",
        [],
        {},
        [0, 0]
    ]);
    let mut sound = 0;
    for path in &paths {
        for replacement in replacements.as_array().unwrap() {
            let mut damaged = file.clone();
            *damaged.json.pointer_mut(path).unwrap() = replacement.clone();
            let text = serde_json::to_vec(&damaged.json).unwrap();
            sound += usize::from(attempt(&glb(text, damaged.bin)).is_ok());
        }
        let mut damaged = file.clone();
        let (parent, key) = path.rsplit_once('/').unwrap_or_default();
        if let Some(map) = damaged.json.pointer_mut(parent).unwrap().as_object_mut() {
            map.remove(key);
        }
        let _ = attempt(&glb(serde_json::to_vec(&damaged.json).unwrap(), damaged.bin));
    }
    assert!(sound > 0, "some replacements are harmless, or nothing was tested");
}

#[test]
fn any_byte_of_the_buffer_may_hold_anything() {
    let file = everything();
    for at in 0..file.bin.len() {
        for value in [0, 1, 2, 3, 4, 127, 128, 192, 255] {
            let mut damaged = file.clone();
            damaged.bin[at] = value;
            let _ = attempt(&damaged.glb()).map(|scene| scene.checked().unwrap());
        }
    }
}

#[test]
fn random_damage_is_survived() {
    let whole = everything().glb();
    let mut state = 7u64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    for _ in 0..20_000 {
        let mut damaged = whole.clone();
        for _ in 0..=next(4) {
            let at = next(damaged.len());
            damaged[at] = [next(256) as u8, b'9', b'0', b'-', 0xff][next(5)];
        }
        let _ = attempt(&damaged);
    }
}

#[test]
fn counts_without_bytes_are_refused() {
    let mut file = Builder::triangle();
    file.json["accessors"][0]["count"] = json!(u32::MAX);
    assert!(error(&file).contains("accessor 0"));
    file.json["accessors"][0]["count"] = json!(1_000_000);
    assert!(error(&file).contains("justifies"), "{}", error(&file));
    file.json["accessors"][0]["count"] = json!(4);
    assert!(error(&file).contains("within the 36 bytes"), "{}", error(&file));
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    file.json["accessors"][0]["count"] = json!(100_000);
    assert!(error(&file).contains("bytes of the file"), "{}", error(&file));
}

#[test]
fn meshes_shown_too_often_for_the_size_of_the_file_are_refused() {
    let mut file = Builder::new();
    let position = file.vectors(&vec![[0.0; 3]; 3000]);
    let primitives = vec![json!({"attributes": {"POSITION": position}}); 1000];
    file.push("meshes", json!({"primitives": primitives}));
    file.json["nodes"] = json!(vec![json!({"mesh": 0}); 1000]);
    assert!(error(&file).contains("justifies"), "{}", error(&file));
}

#[test]
fn a_fan_of_many_faces_takes_no_quadratic_time() {
    let count = 200_000;
    let mut file = Builder::new();
    let rim =
        (0..count).map(|i| 1e-3 * i as f32).map(|a| [a.cos() * (1.0 + a), 0.1 * a, a.sin() * (1.0 + a)]);
    let position = file.vectors(&std::iter::once([0.0; 3]).chain(rim).collect::<Vec<_>>());
    let mesh = file.mesh(json!({"POSITION": position}), json!({"mode": 6}));
    file.push("nodes", json!({"mesh": mesh}));
    let start = std::time::Instant::now();
    assert!(attempt(&file.glb()).unwrap().triangle.len() > count / 2);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
#[ignore = "writes fuzz/seeds/gltf"]
fn write_fuzz_seeds() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/gltf");
    let file = everything();
    let content: String = file.bin.iter().map(|b| format!("%{b:02X}")).collect();
    std::fs::write(folder.join("everything.glb"), file.glb()).unwrap();
    std::fs::write(folder.join("everything.gltf"), file.text(Some(&format!("data:,{content}")))).unwrap();
    std::fs::write(folder.join("triangle.glb"), Builder::triangle().glb()).unwrap();
    std::fs::write(folder.join("skinned.glb"), placement::skinned().glb()).unwrap();
    for (name, mode) in [("list", 4), ("strip", 5), ("fan", 6)] {
        let file = arrays::quad(5121, &[0, 1, 2, 3, 2, 1], mode);
        std::fs::write(folder.join(name).with_extension("glb"), file.glb()).unwrap();
    }
}
