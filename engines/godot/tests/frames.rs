//! Visibility that Godot wrote (project/tests/frames.gd) against the CPU's, on a frame whose depth and normals rays know exactly.
//! `./test` runs Godot first and names the folder in AONET_GODOT_FRAMES.

#[path = "../../bevy/tests/common/boxes.rs"]
mod boxes;

use aonet::net::{Model, cpu::Session, shipped};
use aonet::search::Classic;
use aonet::{AoImage, AoParams, Camera, Size};
use std::path::PathBuf;

const SIZE: Size = Size::px(160, 90);
const EYE: [f32; 3] = [1.6, 2.2, 3.4];
const TARGET: [f32; 3] = [0.0, 0.5, -1.0];
/// Linear light of the open surfaces' ambient, 0.8, on white.
const AMBIENT: f32 = 0.8;

fn folder() -> PathBuf {
    std::env::var_os("AONET_GODOT_FRAMES").expect("AONET_GODOT_FRAMES: engines/godot/test sets it").into()
}

fn bytes(file: &str) -> Vec<u8> {
    std::fs::read(folder().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn half(bytes: [u8; 2]) -> f32 {
    let bits = u16::from_le_bytes(bytes);
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    assert!(bits < 0x7c00, "a finite number that is not negative");
    if exponent == 0 {
        mantissa * 2f32.powi(-24)
    } else {
        (1.0 + mantissa / 1024.0) * 2f32.powi(exponent - 15)
    }
}

/// Visibility of 16-bit floats.
fn visibility(name: &str) -> Vec<f32> {
    bytes(&format!("{name}.r16")).chunks_exact(2).map(|b| half([b[0], b[1]])).collect()
}

/// The first channel of a picture of linear 16-bit floats.
fn picture(name: &str) -> Vec<f32> {
    bytes(&format!("{name}.rgb16")).chunks_exact(6).map(|b| half([b[0], b[1]])).collect()
}

fn lens(size: Size) -> Camera {
    placed(Camera::perspective(0.9, size).unwrap(), EYE)
}

fn placed(camera: Camera, eye: [f32; 3]) -> Camera {
    camera.looking_at(eye, TARGET, [0.0, 1.0, 0.0]).unwrap()
}

fn network(name: &str) -> Model {
    let (_, bytes) =
        shipped::ALL.into_iter().find(|(known, _)| *known == name).expect("a network or a classic method");
    Model::from_bytes(bytes).unwrap()
}

fn expected(method: &str, camera: Camera, radius: f32) -> Vec<f32> {
    let gbuffer = boxes::frame(camera);
    let params = AoParams::new(radius).unwrap();
    if let Ok(classic) = Classic::named(method) {
        return classic.run(&gbuffer, params).unwrap().visibility().to_vec();
    }
    let mut image = AoImage::open(gbuffer.window().size());
    let model = network(method);
    Session::new(&model, gbuffer.window(), 1).unwrap().run(&gbuffer, params, &mut image).unwrap();
    image.visibility().to_vec()
}

/// Mean difference and the share of pixels that differ by more than 0.03.
fn difference(found: &[f32], expected: &[f32]) -> (f32, f32) {
    assert_eq!(found.len(), expected.len());
    let differences: Vec<_> = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).collect();
    let count = found.len() as f32;
    let far = differences.iter().filter(|d| **d > 0.03).count() as f32;
    (differences.iter().sum::<f32>() / count, far / count)
}

/// Godot's rasteriser decides otherwise on single pixels of edges, whose neighbours a network changes as well, and its normals have 8
/// bits a channel.
fn agrees(what: &str, found: &[f32], expected: &[f32]) -> bool {
    let (mean, far) = difference(found, expected);
    println!("{what}: mean difference {mean:.5}, {:.2} % of the pixels by more than 0.03", 100.0 * far);
    let open = expected.iter().sum::<f32>() / expected.len() as f32;
    assert!(open < 0.95, "{what}: the frame has too little occlusion to compare, mean {open}");
    mean < 3e-3 && far < 0.01
}

#[track_caller]
fn assert_agrees(what: &str, found: &[f32], expected: &[f32]) {
    assert!(agrees(what, found, expected), "{what} differs");
}

#[test]
fn every_program_finds_what_it_finds_on_the_cpu() {
    for name in ["fast", "balanced", "high"] {
        assert_agrees(name, &visibility(name), &expected(name, lens(SIZE), 1.0));
    }
    assert_agrees("agtao", &visibility("agtao"), &expected("agtao:tuned", lens(SIZE), 1.0));
    assert_agrees("half floats", &visibility("balanced_f16"), &expected("balanced", lens(SIZE), 1.0));
    assert_ne!(visibility("balanced_f16"), visibility("balanced"));
}

#[test]
fn every_kind_of_camera_agrees() {
    let agtao = |camera| expected("agtao:tuned", camera, 1.0);
    let parallel = placed(Camera::orthographic(5.0, SIZE).unwrap(), EYE);
    assert_agrees("orthographic", &visibility("orthographic"), &agtao(parallel));
    // A near plane of 0.1 by 0.1778 at 0.1: 900 pixels a unit, and offsets of 0.03 and 0.02.
    let off_centre =
        lens(SIZE).with_focal_px([90.0; 2]).unwrap().with_centre_px([80.0 - 27.0, 45.0 + 18.0]).unwrap();
    assert_agrees("off-centre", &visibility("off_centre"), &agtao(off_centre));
    let resized = lens(Size::px(200, 120));
    assert_agrees("resized", &visibility("resized"), &agtao(resized));
    // Of each pixel, Godot keeps the depth of one sample, which is not in its middle.
    let (mean, _) = difference(&visibility("multisampled"), &agtao(lens(SIZE)));
    println!("multisampled: mean difference {mean:.5}");
    assert!(mean < 0.015, "multisampled: {mean}");
    assert_agrees("smaller radius", &visibility("near"), &expected("agtao:tuned", lens(SIZE), 0.6));
    assert_agrees("after mistakes", &visibility("mended"), &agtao(lens(SIZE)));
}

/// Projections of cameras and of shaders are the same lens.
#[test]
fn both_kinds_of_projections_give_the_same_numbers() {
    let numbers = bytes("numbers.bin");
    assert_eq!(numbers.len(), 3 * 2 * 112);
    for frame in numbers.chunks_exact(2 * 112) {
        let (camera, shader) = frame.split_at(112);
        assert_eq!(camera[..56], shader[..56]);
        let floats = |bytes: &[u8]| -> Vec<f32> {
            bytes[56..92].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
        };
        for (a, b) in floats(camera).into_iter().zip(floats(shader)) {
            assert!((a - b).abs() <= 1e-4 * (1e-1 + a.abs()), "{a} and {b}");
        }
    }
}

#[test]
fn viewports_do_not_disturb_each_other() {
    assert_agrees("left", &visibility("left"), &expected("agtao:tuned", lens(SIZE), 1.0));
    let turned = placed(Camera::perspective(0.9, Size::px(120, 90)).unwrap(), [-1.5, 2.0, 3.0]);
    assert_agrees("right", &visibility("right"), &expected("agtao:tuned", turned, 1.0));
}

/// The comparison sees a camera that is turned, another radius and another method.
#[test]
fn other_frames_differ() {
    let found = visibility("agtao");
    assert!(!agrees(
        "another eye",
        &found,
        &expected("agtao:tuned", placed(lens(SIZE), [1.7, 2.2, 3.4]), 1.0)
    ));
    assert!(!agrees("another radius", &found, &expected("agtao:tuned", lens(SIZE), 1.2)));
    assert!(!agrees("another method", &found, &expected("gtao:tuned", lens(SIZE), 1.0)));
}

#[test]
fn materials_darken_ambient_light_by_it() {
    let lit = picture("lit");
    let stored: Vec<f32> = bytes("lit.r8").iter().map(|b| f32::from(*b) / 255.0).collect();
    // The background stays white.
    let surfaces: Vec<usize> = (0..lit.len()).filter(|i| (picture("off")[*i] - 1.0).abs() > 0.05).collect();
    assert!(surfaces.len() > lit.len() / 2);
    let mean =
        surfaces.iter().map(|i| (lit[*i] - AMBIENT * stored[*i]).abs()).sum::<f32>() / surfaces.len() as f32;
    println!("light of {} pixels: mean difference {mean:.5}", surfaces.len());
    assert!(mean < 4e-3, "{mean}");
    // Power 2, in 8 bits.
    let squares = bytes("intense.r8").iter().map(|b| f32::from(*b) / 255.0).collect::<Vec<_>>();
    let raw = visibility("agtao");
    assert!(squares.iter().zip(&raw).all(|(a, b)| (a - b * b).abs() < 3e-3));
    assert!(stored.iter().zip(&raw).all(|(a, b)| (a - b).abs() < 3e-3));
}

#[test]
fn without_it_nothing_is_darkened_and_godots_own_search_works() {
    let open = picture("off");
    let surface = open.iter().copied().fold(1.0, f32::min);
    assert!(open.iter().all(|v| (v - surface).abs() < 5e-3 || (v - 1.0).abs() < 5e-3), "flat light");
    assert!(difference(&open, &picture("lit")).0 > 0.02 && difference(&open, &picture("stock")).0 > 0.005);
    for mistake in ["no_radius", "no_program", "no_list", "no_shaders"] {
        assert_eq!(difference(&open, &picture(mistake)).0, 0.0, "{mistake}");
    }
}

/// Its network is another one than that of the picture with `agtao`.
#[test]
fn the_readmes_code_works() {
    let (readme, lit) = (picture("readme"), picture("lit"));
    let expected: Vec<f32> = expected("balanced", lens(SIZE), 1.0);
    let open = picture("off");
    let found: Vec<f32> =
        readme.iter().zip(&open).map(|(v, open)| if *open < 0.9 { v / open } else { 1.0 }).collect();
    assert_agrees("README", &found, &expected);
    assert!(difference(&readme, &lit).0 > 1e-3);
}

#[test]
fn mistakes_are_errors_on_the_console() {
    let log = String::from_utf8(bytes("godot.log")).unwrap();
    for sentence in [
        "aonet: radius: expected a finite length above 0, found 0",
        "aonet: program: expected a file of addons/aonet/programs, found none",
        "aonet: program: expected one of this version, found another",
        "aonet: environment: expected one (WorldEnvironment, or of the camera), found none",
        "aonet: 160x90: expected shaders and memory that the device gives, found the error above",
    ] {
        assert_eq!(log.matches(sentence).count(), 1, "{sentence}");
    }
    let errors = log
        .lines()
        .take_while(|line| !line.contains("wrote mended"))
        .filter(|line| line.contains("ERROR") && !line.contains("aonet: "))
        .collect::<Vec<_>>();
    assert!(errors.is_empty(), "{errors:#?}");
}
