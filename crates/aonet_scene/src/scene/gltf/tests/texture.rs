//! Textures of base colours.

use super::*;
use crate::scene::textures::{Image, Wrap};
use serde_json::{Value, json};

/// A mesh of triangles whose places in its image are their x and z, shown by the node at index 0.
fn file(corners: &[[f32; 3]]) -> Builder {
    let mut file = Builder::new();
    let places: Vec<_> = corners.iter().map(|&[x, _, z]| [x, z]).collect();
    let attributes = json!({"POSITION": file.vectors(corners), "TEXCOORD_0": file.vectors(&places)});
    let view = file.view(b"wood");
    file.push("images", json!({"bufferView": view, "name": "wood"}));
    file.push("textures", json!({"source": 0}));
    file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let mesh = file.mesh(attributes, json!({"material": 0}));
    file.push("nodes", json!({"mesh": mesh}));
    file
}

fn texture(file: &mut Builder) -> &mut Value {
    &mut file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
}

/// Places in the image of all corners, triangle by triangle.
fn places(scene: &Scene) -> Vec<[f32; 2]> {
    scene.textures.decal.iter().flat_map(|decal| decal.unwrap().uv).collect()
}

fn only_image(file: &Builder) -> Image {
    let scene = load(file);
    assert_eq!(scene.textures.image.len(), 1);
    scene.textures.image[0].clone()
}

#[test]
fn corners_keep_their_places_when_vertices_move_split_and_vanish() {
    // A triangle without area, then two that bend: normals that are made up split and join their vertices.
    let mut corners = vec![[0.5; 3]; 3];
    corners.extend(TRIANGLE);
    corners.extend([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.7, 1.0]]);
    let mut file = file(&corners);
    let translation = file.vectors(&[[0.0; 3], [0.0; 3]]);
    let scale = file.vectors(&[[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]);
    let instances = json!({"attributes": {"TRANSLATION": translation, "SCALE": scale}});
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": instances});
    for missing in [MissingNormals::Flat, MissingNormals::Crease { angle_deg: 179.0 }] {
        let scene = from_bytes(&file.glb(), None, "test", missing).unwrap();
        assert_eq!(scene.triangle.len(), 4);
        let expected: Vec<_> = soup(&scene).iter().map(|p| [p.x.abs(), p.z]).collect();
        assert_eq!(places(&scene), expected);
        // The image multiplies white.
        assert_eq!(scene.albedo, [[1.0; 3]; 4]);
    }
}

#[test]
fn transforms_apply_as_the_example_of_their_extension_says() {
    let mut file = file(&[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]);
    let quarter = std::f32::consts::FRAC_PI_2;
    texture(&mut file)["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0, 1], "rotation": quarter, "scale": [0.5, 0.5]}});
    // The lower left quarter: its lower left corner for (0, 0), and v runs to the right.
    let expected = [[0.0, 1.0], [0.5, 1.0], [0.5, 0.5]];
    let found = places(&load(&file));
    let near = |(a, b): (&[f32; 2], &[f32; 2])| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < 1e-6;
    assert!(found.iter().zip(&expected).all(near), "{found:?}");
}

#[test]
fn coordinates_are_those_that_the_texture_or_its_transform_names() {
    let mut file = file(&TRIANGLE);
    let other = file.vectors(&[[0.25, 0.25]; 3]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_3"] = json!(other);
    let other = [[0.25; 2]; 3];
    assert_ne!(places(&load(&file)), other);
    texture(&mut file)["texCoord"] = json!(3);
    assert_eq!(places(&load(&file)), other);
    texture(&mut file)["extensions"] = json!({"KHR_texture_transform": {"texCoord": 0}});
    assert_ne!(places(&load(&file)), other);
    // Without coordinates there is no image, and no white paint.
    texture(&mut file)["extensions"] = json!({"KHR_texture_transform": {"texCoord": 9}});
    let scene = load(&file);
    assert!(scene.textures.decal.is_empty() && scene.albedo.is_empty());
}

#[test]
fn images_go_on_as_their_samplers_say() {
    for (sampler, expected) in [
        (json!({}), [Wrap::Repeat, Wrap::Repeat]),
        (json!({"wrapS": 33071}), [Wrap::Clamp, Wrap::Repeat]),
        (json!({"wrapS": 10497, "wrapT": 33648}), [Wrap::Repeat, Wrap::Mirror]),
        (json!({"wrapT": 1}), [Wrap::Repeat, Wrap::Repeat]),
    ] {
        let mut file = file(&TRIANGLE);
        file.push("samplers", sampler);
        file.json["textures"][0]["sampler"] = json!(0);
        assert_eq!(load(&file).textures.decal[0].unwrap().wrap, expected);
    }
}

#[test]
fn images_are_embedded_written_out_or_beside_the_file() {
    assert_eq!(&*only_image(&file(&TRIANGLE)).read().unwrap(), b"wood");
    let mut written = file(&TRIANGLE);
    written.json["images"][0] = json!({"uri": "data:image/png;base64,d29vZA=="});
    assert_eq!(&*only_image(&written).read().unwrap(), b"wood");
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a tree.png"), b"tree").unwrap();
    let beside = |uri: &str| {
        let mut file = file(&TRIANGLE);
        file.json["images"][0] = json!({"uri": uri});
        let path = dir.path().join("scene.glb");
        std::fs::write(&path, file.glb()).unwrap();
        super::super::load(&path, MissingNormals::Flat).unwrap().textures.image.remove(0)
    };
    let tree = beside("a%20tree.png");
    assert_eq!((&*tree.read().unwrap(), tree.name.as_str()), (&b"tree"[..], "image \"a%20tree.png\""));
    // Who traces the scene does not wait for its images.
    std::fs::write(dir.path().join("a tree.png"), b"oak").unwrap();
    assert_eq!(&*tree.read().unwrap(), b"oak");
    for (uri, why) in [("no.png", "no.png"), ("../a.png", "stays in the folder"), ("data:,%", "")] {
        let image = beside(uri);
        assert!(image.read().is_err_and(|found| found.contains(why)) || why.is_empty(), "{image:?}");
    }
    // In a file without a folder.
    let mut alone = file(&TRIANGLE);
    alone.json["images"][0] = json!({"uri": "a%20tree.png"});
    assert!(only_image(&alone).read().unwrap_err().contains("no folder"));
}

#[test]
fn images_without_bytes_say_why_and_refuse_no_file() {
    let why = |change: fn(&mut Builder)| {
        let mut file = file(&TRIANGLE);
        change(&mut file);
        only_image(&file).read().unwrap_err()
    };
    assert!(why(|f| f.json["images"][0] = json!({})).contains("neither"));
    assert!(why(|f| f.json["images"][0] = json!({"uri": "data:nothing"})).contains("comma"));
    let compressed = |f: &mut Builder| {
        f.json["textures"][0] = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
    };
    assert!(why(compressed).contains("KHR_texture_basisu"));
}

#[test]
fn a_broken_index_or_array_is_an_error() {
    for (path, value, named) in [
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(7), "texture index"),
        ("/textures/0/source", json!(7), "image index"),
        ("/images/0/bufferView", json!(70), "buffer view index"),
        ("/bufferViews/2/byteLength", json!(1u64 << 40), "buffer view 2"),
        ("/accessors/1/count", json!(2), "one length"),
        ("/accessors/1/type", json!("VEC3"), "2 components"),
    ] {
        let mut file = file(&TRIANGLE);
        *file.json.pointer_mut(path).unwrap() = value;
        assert!(error(&file).contains(named), "{path}: {}", error(&file));
    }
    let mut file = file(&TRIANGLE);
    file.json["textures"][0]["sampler"] = json!(0);
    assert!(error(&file).contains("sampler index"));
}

#[test]
fn places_that_are_no_numbers_are_the_origin() {
    let mut file = file(&TRIANGLE);
    // The second corner is at (0, 1), the third at (1, 0).
    file.bin[48..52].copy_from_slice(&f32::INFINITY.to_le_bytes());
    file.bin[52..56].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(places(&load(&file)), [[0.0; 2]; 3]);
}

#[test]
fn images_that_lie_on_each_other_do_not_multiply_the_file() {
    let mut file = file(&TRIANGLE);
    let view = file.view(&[7; 100_000]);
    for i in 1..40 {
        file.push("images", json!({"bufferView": view}));
        file.push("textures", json!({"source": i}));
        let texture = json!({"baseColorTexture": {"index": i}});
        file.push("materials", json!({"pbrMetallicRoughness": texture}));
        let primitive = file.json["meshes"][0]["primitives"][0].clone();
        let mesh = file.push("meshes", json!({"primitives": [primitive]}));
        file.json["meshes"][mesh]["primitives"][0]["material"] = json!(i);
        file.push("nodes", json!({"mesh": mesh}));
    }
    let scene = load(&file);
    let read = scene.textures.image.iter().filter(|image| image.file.is_ok()).count();
    assert_eq!((scene.textures.image.len(), read), (40, 2));
}
