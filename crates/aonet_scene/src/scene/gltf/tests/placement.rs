//! Nodes, instances, skins, morph targets.

use super::*;
use serde_json::{Value, json};

/// A mesh of one triangle with normals, shown by the node at index 0.
fn with_normals(positions: &[[f32; 3]; 3], normal: [f32; 3]) -> Builder {
    let mut file = Builder::new();
    let position = file.vectors(positions);
    let normal = file.vectors(&[normal; 3]);
    let mesh = file.mesh(json!({"POSITION": position, "NORMAL": normal}), json!({}));
    file.push("nodes", json!({"mesh": mesh}));
    file
}

fn set(file: &mut Builder, node: usize, fields: Value) {
    for (key, value) in fields.as_object().unwrap() {
        file.json["nodes"][node][key] = value.clone();
    }
}

#[test]
fn parents_apply_after_children_and_scale_before_rotation() {
    let mut file = Builder::triangle();
    let half = 0.5f64.sqrt();
    // Child: doubled along x, then a quarter turn about y (x -> -z, z -> x), then up by 1. Parent: +10 x, tripled.
    set(&mut file, 0, json!({"translation": [0, 1, 0], "rotation": [0, half, 0, half], "scale": [2, 1, 1]}));
    file.push("nodes", json!({"children": [0], "translation": [10, 0, 0], "scale": [3, 3, 3]}));
    let expected = [Vec3::new(10.0, 3.0, 0.0), Vec3::new(13.0, 3.0, 0.0), Vec3::new(10.0, 3.0, -6.0)];
    assert_near(&soup(&load(&file)), &expected);
    set(&mut file, 0, json!({"matrix": [0, 0, -2, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1]}));
    assert_near(&soup(&load(&file)), &expected);
    set(&mut file, 0, json!({"matrix": null, "rotation": [0, 5, 0, 5]}));
    assert_near(&soup(&load(&file)), &expected);
}

#[test]
fn mirrored_nodes_keep_their_front() {
    for scale in [json!([-1, 1, 1]), json!([1, -2, 1]), json!([-1, -1, -3]), json!([-1, 1, -1])] {
        let mut file = with_normals(&TRIANGLE, [0.0, 1.0, 0.0]);
        set(&mut file, 0, json!({"scale": scale}));
        let scene = load(&file);
        let up = if scale[1].as_f64().unwrap() < 0.0 { -Vec3::Y } else { Vec3::Y };
        assert_near(&scene.normal, &[up; 3]);
        assert_fronts(&scene);
        let mut file = Builder::triangle();
        set(&mut file, 0, json!({"scale": scale}));
        assert_near(&load(&file).normal, &[up; 3]);
    }
}

#[test]
fn normals_of_stretched_surfaces_stay_perpendicular() {
    // The plane x + y = 1, doubled along x: x / 2 + y = 1.
    let mut file = with_normals(
        &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]],
        [0.5f32.sqrt(), 0.5f32.sqrt(), 0.0],
    );
    set(&mut file, 0, json!({"scale": [2, 1, 1]}));
    let scene = load(&file);
    assert_near(&scene.normal, &[Vec3::new(0.5, 1.0, 0.0).normalize(); 3]);
    assert_fronts(&scene);
}

#[test]
fn a_flattened_mesh_keeps_the_normals_of_its_plane() {
    let mut file = with_normals(&TRIANGLE, [0.6, 0.8, 0.0]);
    set(&mut file, 0, json!({"scale": [1, 0, 1]}));
    assert_near(&load(&file).normal, &[Vec3::Y; 3]);
    set(&mut file, 0, json!({"scale": [1, 1, 0]}));
    assert!(error(&file).contains("at least one triangle"));
}

#[test]
fn the_default_scene_is_shown_else_the_first_else_all_roots() {
    let mut file = Builder::triangle();
    file.push("nodes", json!({"mesh": 0, "translation": [5, 0, 0]}));
    file.push("nodes", json!({"children": [1], "translation": [0, 7, 0]}));
    let firsts = |file: &Builder| soup(&load(file)).into_iter().step_by(3).collect::<Vec<_>>();
    assert_near(&firsts(&file), &[Vec3::ZERO, Vec3::new(5.0, 7.0, 0.0)]);
    file.push("scenes", json!({"nodes": [2]}));
    file.push("scenes", json!({"nodes": [0, 0]}));
    assert_near(&firsts(&file), &[Vec3::new(5.0, 7.0, 0.0)]);
    file.json["scene"] = json!(1);
    assert_near(&firsts(&file), &[Vec3::ZERO]);
    file.json["scene"] = json!(2);
    assert!(error(&file).contains("scene index"));
}

#[test]
fn hidden_nodes_hide_their_children() {
    let mut file = Builder::triangle();
    file.push("nodes", json!({"children": [0], "extensions": {"KHR_node_visibility": {"visible": false}}}));
    file.push("nodes", json!({"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}}));
    assert_eq!(load(&file).triangle.len(), 1);
}

#[test]
fn instances_stand_in_node_space() {
    let mut file = Builder::triangle();
    let translation = file.vectors(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    let scale = file.vectors(&[[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]);
    let attributes = json!({"TRANSLATION": translation, "SCALE": scale});
    set(
        &mut file,
        0,
        json!({"scale": [2, 2, 2], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}),
    );
    let scene = load(&file);
    let first = [Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 0.0, 2.0), Vec3::new(4.0, 0.0, 0.0)];
    let second = [Vec3::new(0.0, 4.0, 0.0), Vec3::new(-2.0, 4.0, 0.0), Vec3::new(0.0, 4.0, 2.0)];
    assert_near(&soup(&scene), &[first, second].concat());
    assert_near(&scene.normal, &[Vec3::Y; 6]);
    file.json["accessors"][scale]["count"] = json!(1);
    assert!(error(&file).contains("EXT_mesh_gpu_instancing"));
}

#[test]
fn morph_targets_apply_at_default_weights_and_the_node_wins() {
    let mut file = with_normals(&TRIANGLE, [0.0, 1.0, 0.0]);
    let up = file.vectors(&[[0.0, 2.0, 0.0]; 3]);
    let lean = file.vectors(&[[1.0, 0.0, 0.0]; 3]);
    let aside = file.vectors(&[[8.0, 0.0, 0.0]; 3]);
    file.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{"POSITION": up, "NORMAL": lean}, {"POSITION": aside}]);
    let moved = |by: Vec3| TRIANGLE.map(|p| Vec3::from(p) + by);
    assert_near(&soup(&load(&file)), &moved(Vec3::ZERO));
    file.json["meshes"][0]["weights"] = json!([1.0, 0.0]);
    let scene = load(&file);
    assert_near(&soup(&scene), &moved(Vec3::Y * 2.0));
    assert_near(&scene.normal, &[Vec3::new(1.0, 1.0, 0.0).normalize(); 3]);
    file.json["nodes"][0]["weights"] = json!([0.5, 0.25]);
    assert_near(&soup(&load(&file)), &moved(Vec3::new(2.0, 1.0, 0.0)));
    file.json["accessors"][up]["count"] = json!(2);
    assert!(error(&file).contains("one length"));
}

/// A triangle of which vertex 0 hangs on joint 0, vertex 1 on joint 1 and vertex 2 on both; node 0 shows it,
/// nodes 1 and 2 are the joints.
pub(super) fn skinned() -> Builder {
    let mut file = with_normals(&TRIANGLE, [0.0, 1.0, 0.0]);
    let joints = file.accessor(&[0, 9, 9, 9, 1, 0, 0, 0, 0, 1, 0, 0].map(|j| j % 9), 5121, ("VEC4", 3));
    let weights = file.vectors(&[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]]);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    // Joint 0 was bound at (0, 1, 0), joint 1 at the origin.
    let mut bind = [glam::Mat4::IDENTITY.to_cols_array(); 2];
    bind[0][13] = -1.0;
    let bind = file.vectors(&bind);
    set(&mut file, 0, json!({"skin": 0, "translation": [100, 100, 100]}));
    file.push("nodes", json!({"translation": [0, 3, 0], "children": [2]}));
    file.push("nodes", json!({"translation": [4, 0, 0]}));
    file.push("skins", json!({"joints": [1, 2], "inverseBindMatrices": bind}));
    file
}

#[test]
fn skins_rest_where_their_joints_are_and_not_where_their_node_is() {
    // Joint 0 moves by +2 y, joint 1 by (4, 3, 0).
    let expected = [Vec3::new(0.0, 2.0, 0.0), Vec3::new(4.0, 3.0, 1.0), Vec3::new(3.0, 2.5, 0.0)];
    let mut file = skinned();
    assert_near(&soup(&load(&file)), &expected);
    assert_near(&load(&file).normal, &[Vec3::Y; 3]);
    file.json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    let unbound = [Vec3::new(0.0, 3.0, 0.0), Vec3::new(4.0, 3.0, 1.0), Vec3::new(3.0, 3.0, 0.0)];
    assert_near(&soup(&load(&file)), &unbound);
}

#[test]
fn weights_that_do_not_sum_to_one_are_scaled() {
    let mut file = skinned();
    let view = file.json["accessors"][3]["bufferView"].as_u64().unwrap() as usize;
    let offset = file.json["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
    let weights = [[3.0, 0.0, 0.0, 0.0], [0.0; 4], [0.25, 0.25, 0.0, 0.0]];
    file.bin[offset..offset + 48].copy_from_slice(&builder::bytes(weights.as_flattened()));
    let expected = [Vec3::new(0.0, 2.0, 0.0), Vec3::new(4.0, 3.0, 1.0), Vec3::new(3.0, 2.5, 0.0)];
    assert_near(&soup(&load(&file)), &expected);
}

#[test]
fn a_second_set_of_joints_counts_as_well() {
    let mut file = skinned();
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = attributes["JOINTS_0"].clone();
    attributes["WEIGHTS_1"] = attributes["WEIGHTS_0"].clone();
    assert_near(&soup(&load(&file)), &soup(&load(&skinned())));
    file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_1"] = json!(0);
    assert!(error(&file).contains("accessor 0"));
}

#[test]
fn a_mirrored_skeleton_keeps_the_front() {
    let mut file = skinned();
    set(&mut file, 1, json!({"scale": [-1, 1, 1]}));
    let scene = load(&file);
    assert_fronts(&scene);
    assert_near(&scene.normal, &[Vec3::Y; 3]);
}

#[test]
fn joints_past_the_skin_are_named() {
    let mut file = skinned();
    file.json["skins"][0]["joints"] = json!([1]);
    assert!(error(&file).contains("primitive 0 joints"), "{}", error(&file));
    file.json["skins"][0]["joints"] = json!([1, 9]);
    assert!(error(&file).contains("joint node index"));
    file.json["skins"][0]["joints"] = json!([1, 2, 0]);
    assert!(error(&file).contains("inverse bind matrix"));
}

#[test]
fn cycles_and_second_parents_are_refused() {
    let mut file = Builder::triangle();
    file.push("nodes", json!({"children": [2]}));
    file.push("nodes", json!({"children": [1]}));
    assert!(error(&file).contains("cycles") && error(&file).contains("node 1"), "{}", error(&file));
    file.json["nodes"][2]["children"] = json!([2]);
    assert!(error(&file).contains("one parent"));
    file.json["nodes"][1]["children"] = json!([0]);
    file.json["nodes"][2]["children"] = json!([0]);
    assert!(error(&file).contains("node 0: expected at most one parent"), "{}", error(&file));
    file.json["nodes"][1]["children"] = json!([1]);
    file.json["nodes"][2]["children"] = json!([]);
    assert!(error(&file).contains("cycles"));
}

#[test]
fn a_hierarchy_of_any_depth_is_walked() {
    let depth = 50_000;
    let mut file = Builder::triangle();
    set(&mut file, 0, json!({"translation": [0, 1, 0]}));
    let links = (0..depth).map(|i| json!({"children": [i], "translation": [0, 1, 0]}));
    file.json["nodes"].as_array_mut().unwrap().extend(links);
    let expected = TRIANGLE.map(|p| Vec3::from(p) + Vec3::Y * (depth + 1) as f32);
    assert_near(&soup(&load(&file)), &expected);
}
