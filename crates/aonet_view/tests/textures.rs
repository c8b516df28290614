//! Textures of glTF files on rasterised triangles: known texels at known positions.

mod common;

use aonet::Size;
use aonet::gpu::Device;
use aonet_scene::scene::{DEFAULT_ALBEDO, MissingNormals, gltf};
use aonet_scene::{Scene, View};
use aonet_view::renderer::readback;
use aonet_view::{FrameParams, Method, Renderer};
use common::{device, draw, frame, renderer};
use image::{ImageFormat, RgbImage};
use serde_json::{Value, json};

/// Steps of 255 that a channel may differ by: sRGB is decoded and encoded on the way.
const STEP: u8 = 1;

/// Sixteen different colours.
fn tile() -> RgbImage {
    RgbImage::from_fn(4, 4, |x, y| image::Rgb([40 + 60 * x as u8, 30 + 70 * y as u8, 250 - 50 * x as u8]))
}

fn png(image: &RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn uri(bytes: &[u8]) -> String {
    let escaped: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    format!("data:application/octet-stream,{escaped}")
}

/// A square from -1 to 1 in the plane z = 0 that shows `image` from `uv[0]` at its upper left corner to `uv[1]` at its lower
/// right one.
fn square(image: &[u8], uv: [f32; 2], other: Value) -> Scene {
    let corners = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
    let place = |c: f32| uv[0] + (uv[1] - uv[0]) * (0.5 + 0.5 * c);
    let positions = corners.iter().flat_map(|&[x, y]| [x, y, 0.0f32]);
    let places = corners.iter().flat_map(|&[x, y]| [place(x), place(-y)]);
    let colours = [0.5f32, 0.25, 1.0].repeat(4);
    let floats = positions.chain(places).chain(colours).flat_map(f32::to_le_bytes);
    let bytes: Vec<u8> = floats.chain([0, 1, 2, 0, 2, 3]).collect();
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let floats = |view: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": kind});
    let indices = json!({"bufferView": 3, "componentType": 5121, "count": 6, "type": "SCALAR"});
    let mut file = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bytes.len(), "uri": uri(&bytes)}],
        "bufferViews": [view(0, 48), view(48, 32), view(80, 48), view(128, 6)],
        "accessors": [floats(0, "VEC3"), floats(1, "VEC2"), floats(2, "VEC3"), indices],
        "images": [{"uri": uri(image), "name": "tile"}],
        "samplers": [{}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 3, "material": 0}]}],
        "nodes": [{"mesh": 0}],
    });
    for (path, value) in other.as_object().unwrap() {
        let (parent, key) = path.rsplit_once('/').unwrap();
        file.pointer_mut(parent).unwrap()[key] = value.clone();
    }
    let text = serde_json::to_vec(&file).unwrap();
    gltf::from_bytes(&text, None, "square", MissingNormals::Flat).unwrap()
}

/// The reflectance of a scene, seen along -Z by parallel rays that the square fills with `side` x `side` pixels.
fn albedo(device: &Device, scene: &Scene, side: usize) -> (RgbImage, Renderer) {
    let mut renderer = renderer(device, scene, Size::px(side, side));
    (drawn(device, &mut renderer), renderer)
}

fn drawn(device: &Device, renderer: &mut Renderer) -> RgbImage {
    let side = renderer.size().width();
    let view = json!({"eye": [0, 0, 3], "target": [0, 0, 0], "width": side, "height": side, "ortho_height": 2, "radius": 1});
    let view: View = serde_json::from_value(view).unwrap();
    draw(device, renderer, &FrameParams { methods: [Method::Off; 2], ..frame(&view) });
    readback::albedo(renderer).unwrap()
}

/// Checks the middle pixel of texels that cover nine pixels each against `expected(column, row)`.
#[track_caller]
fn assert_texels(found: &RgbImage, expected: impl Fn(u32, u32) -> [u8; 3]) {
    for (x, y) in (0..found.width() / 9).flat_map(|x| (0..found.height() / 9).map(move |y| (x, y))) {
        let (found, expected) = (found.get_pixel(9 * x + 4, 9 * y + 4).0, expected(x, y));
        let far = found.iter().zip(expected).any(|(a, b)| a.abs_diff(b) > STEP);
        assert!(!far, "texel {x}, {y}: {found:?}, not {expected:?}");
    }
}

#[test]
fn texels_are_seen_where_they_belong() {
    let Some(device) = device() else { return };
    let scene = square(&png(&tile()), [0.0, 1.0], json!({}));
    let (found, renderer) = albedo(&device, &scene, 36);
    assert!(renderer.missing_images().is_empty());
    assert_texels(&found, |x, y| tile().get_pixel(x, y).0);
    let wrong = || assert_texels(&found, |x, y| tile().get_pixel(y, x).0);
    assert!(std::panic::catch_unwind(wrong).is_err());
}

/// IEC 61966-2-1.
fn scaled(value: u8, factor: f32) -> u8 {
    let v = f32::from(value) / 255.0;
    let linear = factor * if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    let v = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * v).round() as u8
}

#[test]
fn an_image_is_multiplied_by_the_factor_and_by_vertex_colours() {
    let Some(device) = device() else { return };
    let factor = [0.25, 1.0, 0.5];
    let changes = json!({
        "/materials/0/pbrMetallicRoughness/baseColorFactor": [factor[0], factor[1], factor[2], 0.0],
        "/meshes/0/primitives/0/attributes/COLOR_0": 2,
    });
    let (found, _) = albedo(&device, &square(&png(&tile()), [0.0, 1.0], changes), 36);
    let colour = [0.5, 0.25, 1.0];
    assert_texels(&found, |x, y| {
        let texel = tile().get_pixel(x, y).0;
        [0, 1, 2].map(|c| scaled(texel[c], factor[c] * colour[c]))
    });
}

#[test]
fn beyond_its_edges_an_image_repeats_ends_or_is_mirrored() {
    let Some(device) = device() else { return };
    let repeat = |i: u32| i % 4;
    let clamp = |i: u32| i.clamp(4, 7) - 4;
    let mirror = |i: u32| if (4..8).contains(&i) { i - 4 } else { 3 - i % 4 };
    type Place<'a> = &'a dyn Fn(u32) -> u32;
    let modes: [(u32, Place); 3] = [(10497, &repeat), (33071, &clamp), (33648, &mirror)];
    for (wrap_s, along_u) in modes {
        for (wrap_t, along_v) in modes {
            let changes = json!({"/samplers/0/wrapS": wrap_s, "/samplers/0/wrapT": wrap_t});
            let (found, _) = albedo(&device, &square(&png(&tile()), [-1.0, 2.0], changes), 108);
            assert_texels(&found, |x, y| tile().get_pixel(along_u(x), along_v(y)).0);
        }
    }
}

#[test]
fn from_far_away_an_image_is_its_mean() {
    let Some(device) = device() else { return };
    let board = RgbImage::from_fn(64, 64, |x, y| image::Rgb([if (x + y) % 2 == 0 { 255 } else { 0 }; 3]));
    let scene = square(&png(&board), [0.0, 1.0], json!({}));
    // At two texels a pixel, and at four.
    for side in [32, 16] {
        let (found, _) = albedo(&device, &scene, side);
        // Half the light of white, IEC 61966-2-1.
        assert!(
            found.pixels().all(|p| p.0.iter().all(|v| v.abs_diff(188) <= STEP)),
            "{:?}",
            found.get_pixel(3, 3)
        );
    }
}

#[test]
fn an_image_that_cannot_be_shown_is_plain_and_named() {
    let Some(device) = device() else { return };
    let whole = png(&tile());
    let factor = json!({"/materials/0/pbrMetallicRoughness/baseColorFactor": [0.5, 1.0, 1.0, 1.0]});
    let plain = DEFAULT_ALBEDO.map(|c| scaled(255, c));
    for bytes in [&whole[..whole.len() / 2], b"RIFF\x24\0\0\0WEBPVP8 ", b""] {
        let (found, renderer) = albedo(&device, &square(bytes, [0.0, 1.0], json!({})), 9);
        assert_texels(&found, |_, _| plain);
        let said = renderer.missing_images();
        assert!(said.len() == 1 && said[0].contains("\"tile\""), "{said:?}");
        let (found, _) = albedo(&device, &square(bytes, [0.0, 1.0], factor.clone()), 9);
        assert_texels(&found, |_, _| [scaled(255, 0.5 * DEFAULT_ALBEDO[0]), plain[1], plain[2]]);
    }
}

#[test]
fn more_images_than_layers_share_a_plain_one() {
    let Some(device) = device() else { return };
    let layers = device.device.limits().max_texture_array_layers as usize;
    let mut scene = square(&png(&tile()), [0.0, 1.0], json!({}));
    scene.textures.image = vec![scene.textures.image[0].clone(); layers + 2];
    let plain = DEFAULT_ALBEDO.map(|c| scaled(255, c));
    for (image, is_plain) in [(layers - 2, false), (layers - 1, true), (layers + 1, true)] {
        scene.textures.decal.iter_mut().flatten().for_each(|decal| decal.image = image as u32);
        let (found, renderer) = albedo(&device, &scene, 36);
        assert_texels(&found, |x, y| if is_plain { plain } else { tile().get_pixel(x, y).0 });
        assert_eq!(renderer.missing_images().len(), 3);
    }
}

#[test]
fn the_next_scene_has_its_own_images() {
    let Some(device) = device() else { return };
    let scene = square(&png(&tile()), [0.0, 1.0], json!({}));
    let (_, mut renderer) = albedo(&device, &scene, 36);
    let bare = Scene { textures: Default::default(), ..scene.clone() };
    renderer.set_scene(&bare).unwrap();
    assert_texels(&drawn(&device, &mut renderer), |_, _| [255; 3]);
    renderer.set_scene(&scene).unwrap();
    assert_texels(&drawn(&device, &mut renderer), |x, y| tile().get_pixel(x, y).0);
}
