//! Accessors, topologies, normals.

use super::builder::bytes;
use super::*;
use serde_json::json;

#[test]
fn one_triangle_gets_its_face_normal() {
    let scene = load(&Builder::triangle());
    assert_eq!(scene.name, "test");
    assert_near(&soup(&scene), &TRIANGLE.map(Vec3::from));
    assert_near(&scene.normal, &[Vec3::Y; 3]);
}

const QUAD: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]];

pub(super) fn quad(component: u32, index_bytes: &[u8], mode: u32) -> Builder {
    let mut file = Builder::new();
    let position = file.vectors(&QUAD);
    let count = index_bytes.len() / if component == 5125 { 4 } else { component as usize - 5120 };
    let indices = file.accessor(index_bytes, component, ("SCALAR", count));
    let mesh = file.mesh(json!({"POSITION": position}), json!({"indices": indices, "mode": mode}));
    file.push("nodes", json!({"mesh": mesh}));
    file
}

#[test]
fn indices_of_each_width_make_the_same_triangles() {
    let indices = [0u8, 1, 2, 2, 1, 3];
    let expected = indices.map(|i| Vec3::from(QUAD[usize::from(i)]));
    let u16s: Vec<u8> = indices.iter().flat_map(|&i| u16::from(i).to_le_bytes()).collect();
    let u32s: Vec<u8> = indices.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect();
    for (component, bytes) in [(5121, indices.to_vec()), (5125, u32s)] {
        assert_near(&soup(&load(&quad(component, &bytes, 4))), &expected);
    }
    let mut file = quad(5121, &u16s, 4);
    file.json["accessors"][1]["componentType"] = json!(5123);
    file.json["accessors"][1]["count"] = json!(6);
    assert_near(&soup(&load(&file)), &expected);
    file.json["accessors"][1]["componentType"] = json!(5126);
    assert!(error(&file).contains("accessor 1"), "{}", error(&file));
}

#[test]
fn strips_and_fans_keep_their_front() {
    let corners = |i: &[usize]| i.iter().map(|&i| Vec3::from(QUAD[i])).collect::<Vec<_>>();
    let strip = load(&quad(5121, &[0, 1, 2, 3], 5));
    assert_near(&soup(&strip), &corners(&[0, 1, 2, 1, 3, 2]));
    assert_fronts(&strip);
    assert_near(&strip.normal, &vec![Vec3::Y; strip.normal.len()]);
    let fan = load(&quad(5121, &[0, 1, 3, 2], 6));
    assert_near(&soup(&fan), &corners(&[1, 3, 0, 3, 2, 0]));
    assert_near(&fan.normal, &vec![Vec3::Y; fan.normal.len()]);
}

#[test]
fn points_and_lines_are_no_triangles() {
    for mode in 0..4 {
        assert!(error(&quad(5121, &[0, 1, 2], mode)).contains("at least one triangle"));
    }
    assert!(error(&quad(5121, &[0, 1, 2], 7)).contains("mode"));
    for mode in 4..7 {
        for count in 0..3 {
            assert!(error(&quad(5121, &[0, 1, 2][..count], mode)).contains("at least one triangle"));
        }
    }
}

#[test]
fn indices_past_the_vertices_are_named() {
    let message = error(&quad(5121, &[0, 1, 4], 4));
    assert!(message.contains("mesh 0 primitive 0 indices") && message.contains("below 4"), "{message}");
}

#[test]
fn quantised_positions_follow_the_formulas_of_the_specification() {
    type Row = (u32, bool, Vec<u8>, f32);
    let i16s = |v: [i16; 3]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let u16s = |v: [u16; 3]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    // The third vertex is (v, 0, -v), with v the largest value and -v the least (or 0).
    let rows: [Row; 8] = [
        (5120, false, vec![100, 0, 156], 100.0),
        (5120, true, vec![127, 0, 128], 1.0),
        (5121, false, vec![200, 0, 0], 200.0),
        (5121, true, vec![255, 0, 0], 1.0),
        (5122, false, i16s([30000, 0, -30000]), 30000.0),
        (5122, true, i16s([i16::MAX, 0, i16::MIN]), 1.0),
        (5123, false, u16s([60000, 0, 0]), 60000.0),
        (5123, true, u16s([u16::MAX, 0, 0]), 1.0),
    ];
    for (component, normalized, third, v) in rows {
        let size = third.len();
        let one = if size == 3 { vec![1] } else { vec![1, 0] };
        let mut data = vec![0; size];
        data.extend([vec![0; size / 3], one, vec![0; size / 3], third].concat());
        let mut file = Builder::new();
        let position = file.accessor(&data, component, ("VEC3", 3));
        file.json["accessors"][position]["normalized"] = json!(normalized);
        let mesh = file.mesh(json!({"POSITION": position}), json!({}));
        file.push("nodes", json!({"mesh": mesh}));
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let unit = match (component, normalized) {
            (_, false) => 1.0,
            (5120, true) => 1.0 / 127.0,
            (5121, true) => 1.0 / 255.0,
            (5122, true) => 1.0 / 32767.0,
            _ => 1.0 / 65535.0,
        };
        let signed = component == 5120 || component == 5122;
        let expected = [Vec3::ZERO, Vec3::Y * unit, Vec3::new(v, 0.0, if signed { -v } else { 0.0 })];
        assert_near(&soup(&load(&file)), &expected);
    }
}

#[test]
fn interleaved_attributes_are_taken_apart() {
    let mut file = Builder::new();
    let rows: Vec<f32> = TRIANGLE.iter().flat_map(|p| [p[0], p[1], p[2], 0.6, 0.8, 0.0, 9.0]).collect();
    let view = file.view(&bytes(&rows));
    file.json["bufferViews"][view]["byteStride"] = json!(28);
    let accessor = json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": 3});
    let position = file.push("accessors", accessor.clone());
    let normal = file.push("accessors", accessor);
    file.json["accessors"][normal]["byteOffset"] = json!(12);
    let mesh = file.mesh(json!({"POSITION": position, "NORMAL": normal}), json!({}));
    file.push("nodes", json!({"mesh": mesh}));
    let scene = load(&file);
    assert_near(&soup(&scene), &TRIANGLE.map(Vec3::from));
    assert_near(&scene.normal, &[Vec3::new(0.6, 0.8, 0.0); 3]);
    file.json["bufferViews"][view]["byteStride"] = json!(11);
    assert!(error(&file).contains("stride"));
    file.json["bufferViews"][view]["byteStride"] = json!(32);
    assert!(error(&file).contains("buffer view 0"));
}

#[test]
fn sparse_values_replace_a_base_or_zeros() {
    for base in [true, false] {
        let mut file = Builder::triangle();
        let indices = file.view(&[1, 2]);
        let values = file.view(&bytes(&[0.0, 0.0, 3.0, 4.0, 0.0, 0.0]));
        let accessor = &mut file.json["accessors"][0];
        accessor["sparse"] = json!({"count": 2, "indices": {"bufferView": indices, "componentType": 5121},
                                    "values": {"bufferView": values}});
        if !base {
            accessor.as_object_mut().unwrap().remove("bufferView");
        }
        assert_near(&soup(&load(&file)), &[Vec3::ZERO, Vec3::Z * 3.0, Vec3::X * 4.0]);
        file.json["accessors"][0]["sparse"]["indices"]["byteOffset"] = json!(1);
        assert!(error(&file).contains("sparse"));
        *file.bin.last_mut().unwrap() = 0;
        file.json["accessors"][0]["sparse"]["indices"]["byteOffset"] = json!(0);
        file.bin[36] = 3;
        assert!(error(&file).contains("indices below 3"), "{}", error(&file));
    }
}

#[test]
fn unusable_normals_come_from_the_geometry() {
    let unusable = [[0.0; 3], [f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [1e-30, 0.0, 0.0], [0.0, 0.0, 1e30]];
    let expected = [Vec3::Y, Vec3::Y, Vec3::Y, Vec3::X, Vec3::Z];
    for (normal, expected) in unusable.into_iter().zip(expected) {
        let mut file = Builder::new();
        let position = file.vectors(&TRIANGLE);
        let normal = file.vectors(&[normal, [0.0, 2.0, 0.0], [0.0, 1.0, 0.0]]);
        let mesh = file.mesh(json!({"POSITION": position, "NORMAL": normal}), json!({}));
        file.push("nodes", json!({"mesh": mesh}));
        assert_near(&load(&file).normal, &[expected, Vec3::Y, Vec3::Y]);
    }
}

#[test]
fn degenerate_triangles_and_unused_vertices_go() {
    let mut file = Builder::new();
    let nan = [f32::NAN; 3];
    let position = file.vectors(&[nan, TRIANGLE[0], TRIANGLE[1], TRIANGLE[2], [0.0, 0.0, 2.0], [1e9; 3]]);
    let indices = file.indices(&[1, 1, 3, 1, 2, 4, 1, 2, 3]);
    let mesh = file.mesh(json!({"POSITION": position}), json!({"indices": indices}));
    file.push("nodes", json!({"mesh": mesh}));
    let scene = load(&file);
    assert_near(&soup(&scene), &TRIANGLE.map(Vec3::from));
    assert_eq!(scene.position.len(), 3);
    file.bin[72..76].copy_from_slice(&0u32.to_le_bytes());
    assert!(error(&file).contains("mesh 0 primitive 0 position"), "{}", error(&file));
}
