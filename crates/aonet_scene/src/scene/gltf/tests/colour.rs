//! Base colours.

use super::builder::Builder;
use super::{TRIANGLE, error, load};
use serde_json::json;

const COLOURS: [[f32; 3]; 3] = [[0.9, 0.0, 0.3], [0.3, 0.6, 0.3], [0.0, 0.0, 0.3]];

fn file(coloured: bool, material: Option<[f32; 4]>) -> Builder {
    let mut file = Builder::new();
    let mut attributes = json!({"POSITION": file.vectors(&TRIANGLE)});
    if coloured {
        attributes["COLOR_0"] = json!(file.vectors(&COLOURS));
    }
    let mut other = json!({});
    if let Some(factor) = material {
        let material = json!({"pbrMetallicRoughness": {"baseColorFactor": factor}});
        other["material"] = json!(file.push("materials", material));
    }
    let mesh = file.mesh(attributes, other);
    file.push("nodes", json!({"mesh": mesh}));
    file
}

#[test]
fn a_triangle_has_the_factor_times_the_mean_of_its_corners() {
    let near = |file: &Builder, expected: [f32; 3]| {
        let found = load(file).albedo;
        assert!(
            found.len() == 1 && found[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
            "{found:?}"
        );
    };
    near(&file(true, None), [0.4, 0.2, 0.3]);
    near(&file(false, Some([0.5, 0.25, 2.0, 1.0])), [0.5, 0.25, 1.0]);
    near(&file(true, Some([0.5, 0.25, 2.0, 1.0])), [0.2, 0.05, 0.6]);
    assert!(load(&file(false, None)).albedo.is_empty());
}

#[test]
fn what_is_no_colour_is_refused_and_a_missing_material_is_none() {
    let mut scalars = file(true, None);
    scalars.json["accessors"][1]["type"] = json!("SCALAR");
    assert!(error(&scalars).contains("COLOR_0"), "{}", error(&scalars));
    let mut absent = file(false, Some([0.5; 4]));
    absent.json["materials"] = json!([]);
    assert!(load(&absent).albedo.is_empty());
    let mut nan = file(true, None);
    nan.bin[36..40].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(load(&nan).albedo[0][0], 0.0);
}

#[test]
fn colours_of_dropped_triangles_are_dropped() {
    let mut file = Builder::new();
    let mut corners = TRIANGLE.to_vec();
    corners.splice(0..0, [[0.0; 3]; 3]);
    let colours = [[[0.25; 3]; 3], [[0.75; 3]; 3]].concat();
    let attributes = json!({"POSITION": file.vectors(&corners), "COLOR_0": file.vectors(&colours)});
    let mesh = file.mesh(attributes, json!({}));
    file.push("nodes", json!({"mesh": mesh}));
    assert_eq!(load(&file).albedo, [[0.75; 3]]);
}
