//! Small scenes for the tests of this folder.

use super::Scene;
use glam::Vec3;
use std::path::{Path, PathBuf};

/// A box with outward or inward faces.
pub(super) fn cuboid(min: Vec3, max: Vec3, inward: bool) -> Scene {
    let mut scene = Scene::default();
    for axis in 0..3 {
        for side in [min, max] {
            let (mut a, mut b) = (Vec3::ZERO, Vec3::ZERO);
            a[(axis + 1) % 3] = (max - min)[(axis + 1) % 3];
            b[(axis + 2) % 3] = (max - min)[(axis + 2) % 3];
            let mut corner = min;
            corner[axis] = side[axis];
            let outward = Vec3::AXES[axis] * if side == max { 1.0 } else { -1.0 };
            if (a.cross(b).dot(outward) > 0.0) == inward {
                (a, b) = (b, a);
            }
            let position = vec![corner, corner + a, corner + a + b, corner + b];
            let normal = vec![if inward { -outward } else { outward }; 4];
            scene.append(&Scene {
                position,
                normal,
                triangle: vec![[0, 1, 2], [0, 2, 3]],
                ..Scene::default()
            });
        }
    }
    scene
}

/// A room of 6x3x5 with boxes standing in it.
pub(super) fn room() -> Scene {
    let mut scene = cuboid(Vec3::new(-3.0, 0.0, -2.5), Vec3::new(3.0, 3.0, 2.5), true);
    for i in 0..12 {
        let (x, z) = (-2.5 + 1.6 * (i % 4) as f32, -2.0 + 1.8 * (i / 4) as f32);
        let size = Vec3::new(0.4, 0.3 + 0.15 * i as f32, 0.5);
        scene.append(&cuboid(Vec3::new(x, 0.0, z), Vec3::new(x, 0.0, z) + size, false));
    }
    scene
}

/// Boxes on boxes.
pub(super) fn stack() -> Scene {
    let mut scene = Scene::default();
    for i in 0..5 {
        let size = Vec3::new(1.0 - 0.15 * i as f32, 0.3, 0.8 - 0.1 * i as f32);
        let min = Vec3::new(0.1 * i as f32, 0.3 * i as f32, -0.5 * size.z);
        scene.append(&cuboid(min, min + size, false));
    }
    scene
}

/// Writes a scene as GLB, without its normals.
pub(super) fn write_glb(dir: &Path, name: &str, scene: &Scene) -> PathBuf {
    let positions = scene.position.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes);
    let mut bin: Vec<u8> = positions.collect();
    let split = bin.len();
    bin.extend(scene.triangle.iter().flatten().flat_map(|i| i.to_le_bytes()));
    let (vertices, indices, total) = (scene.position.len(), 3 * scene.triangle.len(), bin.len());
    let bounds = scene.bounds();
    let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
    let document = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3", "min": min, "max": max},
            {"bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": split}, {"buffer": 0, "byteOffset": split, "byteLength": total - split}],
        "buffers": [{"byteLength": total}]
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bin)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    let path = dir.join(format!("{name}.glb"));
    std::fs::write(&path, glb).unwrap();
    path
}
