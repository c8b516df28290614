//! Writes scenes as binary glTF files: their triangles and normals, no colours.

use super::Scene;
use crate::atomic_file;
use crate::error::{Error, Result};
use serde_json::json;
use std::path::Path;

// Constants of glTF 2.0, sections 3.6.2.2 and 4.4.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// Writes positions (world units), normals and triangles of a scene as one mesh.
///
/// # Errors
/// When the scene has no triangles or too many for the format, or the file cannot be written; an older file does not change.
pub fn save(scene: &Scene, path: &Path) -> Result<()> {
    // The length of a file is one word; a mebibyte is more than the header takes.
    let most = (u32::MAX - (1 << 20)) as usize;
    let found = 24 * scene.position.len() + 12 * scene.triangle.len();
    if scene.triangle.is_empty() || found > most {
        let expected = format!("triangles of at most {most} bytes");
        return Err(Error::request(
            format!("scene for {}", path.display()),
            expected,
            format!("{found} bytes"),
        ));
    }
    atomic_file::write(path, &bytes(scene))
}

fn bytes(scene: &Scene) -> Vec<u8> {
    let vectors = scene.position.iter().chain(&scene.normal).flat_map(|p| p.to_array());
    let mut bin: Vec<u8> = vectors.flat_map(f32::to_le_bytes).collect();
    let vertices = scene.position.len();
    let (of_vectors, indices) = (12 * vertices, 12 * scene.triangle.len());
    bin.extend(scene.triangle.as_flattened().iter().flat_map(|i| i.to_le_bytes()));
    let bounds = scene.bounds();
    let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
    let document = json!({
        "asset": {"version": "2.0", "generator": "aonet"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": vertices, "type": "VEC3", "min": min, "max": max},
            {"bufferView": 1, "componentType": FLOAT, "count": vertices, "type": "VEC3"},
            {"bufferView": 2, "componentType": UNSIGNED_INT, "count": indices / 4, "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": of_vectors},
            {"buffer": 0, "byteOffset": of_vectors, "byteLength": of_vectors},
            {"buffer": 0, "byteOffset": 2 * of_vectors, "byteLength": indices}],
        "buffers": [{"byteLength": bin.len()}]
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = HEADER_BYTES + 2 * CHUNK_HEADER_BYTES + json.len() + bin.len();
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bin)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    glb
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural::{self, Kind};
    use crate::scene::{MissingNormals, gltf};

    #[test]
    fn a_scene_reads_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hall.glb");
        let hall = procedural::build(Kind::Hall, 3);
        save(&hall, &path).unwrap();
        let read = gltf::load(&path, MissingNormals::Flat).unwrap();
        assert_eq!((read.position, read.triangle), (hall.position, hall.triangle));
        // The reader normalises.
        assert!(read.normal.iter().zip(&hall.normal).all(|(a, b)| a.abs_diff_eq(*b, 1e-6)));
    }

    #[test]
    fn an_empty_scene_is_refused_and_writes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.glb");
        let error = save(&Scene::default(), &path).unwrap_err().to_string();
        assert!(error.contains("empty.glb") && error.contains("triangles"), "{error}");
        assert!(!path.exists());
    }
}
