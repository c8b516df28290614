//! Buffers, containers, versions, extensions.

use super::*;
use serde_json::json;
use std::path::Path;

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = bytes.chunks(3).flat_map(|group| {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(group.get(k).copied().unwrap_or(0)));
        (0..=group.len()).map(move |k| char::from(DIGITS[(bits >> (18 - 6 * k)) as usize & 63]))
    });
    digits.collect()
}

fn from_text(text: &[u8], base_dir: Option<&Path>) -> crate::Result<Scene> {
    from_bytes(text, base_dir, "test", MissingNormals::Flat)
}

#[test]
fn embedded_and_external_buffers_are_the_same_scene() {
    let file = Builder::triangle();
    let expected = load(&file);
    let escaped: String = file.bin.iter().map(|b| format!("%{b:02X}")).collect();
    let data = base64(&file.bin);
    for uri in [
        format!("data:application/octet-stream;base64,{data}"),
        format!("data:;base64,{}", data.replace('+', "%2B").replace('/', "%2f")),
        format!("data:application/gltf-buffer,{escaped}"),
    ] {
        assert_eq!(from_text(&file.text(Some(&uri)), None).unwrap(), expected, "{uri}");
    }
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("sub")).unwrap();
    std::fs::write(dir.path().join("sub/some bytes.bin"), &file.bin).unwrap();
    for uri in ["sub/some%20bytes.bin", "./sub/some bytes.bin"] {
        let path = dir.path().join("test.gltf");
        std::fs::write(&path, file.text(Some(uri))).unwrap();
        assert_eq!(super::super::load(&path, MissingNormals::Flat).unwrap(), expected);
    }
    std::fs::write(dir.path().join("test.glb"), file.glb()).unwrap();
    assert_eq!(super::super::load(&dir.path().join("test.glb"), MissingNormals::Flat).unwrap(), expected);
}

#[test]
fn buffers_outside_the_folder_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("inner");
    std::fs::create_dir(&folder).unwrap();
    let file = Builder::triangle();
    std::fs::write(dir.path().join("x.bin"), &file.bin).unwrap();
    let absolute = dir.path().join("x.bin").display().to_string();
    let outside =
        ["../x.bin", "%2e%2e/x.bin", "a/../../x.bin", "..\\x.bin", &absolute, "file:x.bin", "http://h/x.bin"];
    for uri in outside {
        let message = from_text(&file.text(Some(uri)), Some(&folder)).unwrap_err().to_string();
        assert!(message.contains("stays in the folder"), "{uri}: {message}");
    }
    let message = from_text(&file.text(Some("%ff.bin")), Some(&folder)).unwrap_err().to_string();
    assert!(message.contains("UTF-8"), "{message}");
    let message = from_text(&file.text(Some("x.bin")), None).unwrap_err().to_string();
    assert!(message.contains("embedded data"), "{message}");
    for uri in ["no.bin", ""] {
        let message = from_text(&file.text(Some(uri)), Some(&folder)).unwrap_err().to_string();
        assert!(message.contains("inner"), "{uri}: {message}");
    }
}

#[test]
fn short_and_absent_buffers_are_named() {
    let mut file = Builder::triangle();
    let message = from_text(&file.text(Some("data:;base64,AAAA")), None).unwrap_err().to_string();
    assert!(message.contains("buffer 0") && message.contains("3 bytes"), "{message}");
    let message = from_text(&file.text(Some("data:;base64")), None).unwrap_err().to_string();
    assert!(message.contains("comma"), "{message}");
    let message = from_text(&file.text(None), None).unwrap_err().to_string();
    assert!(message.contains("no uri and no BIN chunk"), "{message}");
    file.json["buffers"] = json!([{"byteLength": 1000}]);
    assert!(error(&file).contains("1000 bytes"));
}

#[test]
fn errors_of_a_file_name_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("broken.glb");
    std::fs::write(&path, b"glTF").unwrap();
    let message = super::super::load(&path, MissingNormals::Flat).unwrap_err().to_string();
    assert!(message.contains("broken.glb") && message.contains("GLB header"), "{message}");
    let message =
        super::super::load(&dir.path().join("none.glb"), MissingNormals::Flat).unwrap_err().to_string();
    assert!(message.contains("none.glb"), "{message}");
}

#[test]
fn compressed_geometry_is_refused_with_a_way_out() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut file = Builder::triangle();
        file.json["extensionsRequired"] = json!([name]);
        assert!(error(&file).contains(name) && error(&file).contains("gltf-transform"), "{}", error(&file));
    }
    let mut file = Builder::triangle();
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    file.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    assert!(error(&file).contains("Draco"));
}

#[test]
fn extensions_of_materials_do_no_harm_and_unknown_ones_are_named() {
    let mut file = Builder::triangle();
    file.json["extensionsRequired"] = json!([
        "KHR_materials_unlit",
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_mesh_quantization"
    ]);
    assert_eq!(load(&file), load(&Builder::triangle()));
    file.json["extensionsRequired"] = json!(["ACME_spline_patches"]);
    assert!(error(&file).contains("ACME_spline_patches"));
}

#[test]
fn other_versions_are_refused() {
    for version in [json!("1.0"), json!(""), json!("3.0"), json!(2)] {
        let mut file = Builder::triangle();
        file.json["asset"]["version"] = version;
        assert!(error(&file).contains("glTF"), "{}", error(&file));
    }
    let mut file = Builder::triangle();
    file.json["asset"] = json!({"version": "2.1", "minVersion": "2.0"});
    assert_eq!(load(&file).triangle.len(), 1);
    file.json["asset"]["minVersion"] = json!("2.1");
    assert!(error(&file).contains("2.1"));
    let mut glb = Builder::triangle().glb();
    glb[4] = 1;
    assert!(from_text(&glb, None).unwrap_err().to_string().contains("GLB version"));
}

#[test]
fn a_byte_order_mark_and_unknown_chunks_are_skipped() {
    let file = Builder::triangle();
    let uri = format!("data:;base64,{}", base64(&file.bin));
    let text = [b"\xef\xbb\xbf".to_vec(), file.text(Some(&uri))].concat();
    assert_eq!(from_text(&text, None).unwrap(), load(&file));
    let mut glb = file.glb();
    glb.extend(b"\x04\0\0\0MORE1234");
    let length = glb.len() as u32;
    glb[8..12].copy_from_slice(&length.to_le_bytes());
    glb.extend(b"beyond");
    assert_eq!(from_text(&glb, None).unwrap(), load(&file));
}

#[test]
fn a_crease_angle_outside_half_a_turn_is_refused() {
    for angle_deg in [-1.0, 181.0, f32::NAN] {
        let glb = Builder::triangle().glb();
        let message =
            from_bytes(&glb, None, "test", MissingNormals::Crease { angle_deg }).unwrap_err().to_string();
        assert!(message.contains("crease angle"), "{message}");
    }
}
