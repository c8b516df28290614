//! Pictures that were inspected by eye. `AONET_UPDATE=1` accepts the current pictures; inspect them first.

mod common;

use aonet::Size;
use aonet_view::renderer::readback;
use aonet_view::{FrameParams, Method, Show};
use common::{demo, device, draw, frame, renderer};
use image::{Rgb, RgbImage};
use std::path::{Path, PathBuf};

const SIZE: Size = Size::px(192, 108);

/// Steps of 255 that a channel may differ by on every pixel. guess: rounding of another device's arithmetic.
const STEP: u8 = 3;

/// Share of the pixels that may differ by more: on edges another rasteriser may decide otherwise, and a horizon search
/// follows.
const MOST_STRAYS: f32 = 0.01;

/// Share of the pixels in which two pictures differ by more than [`STEP`]; 1 where they are of different sizes.
fn strays(found: &RgbImage, expected: &RgbImage) -> f32 {
    if found.dimensions() != expected.dimensions() {
        return 1.0;
    }
    let far = |(a, b): &(&Rgb<u8>, &Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > STEP);
    found.pixels().zip(expected.pixels()).filter(far).count() as f32 / found.pixels().len() as f32
}

/// Compares with `tests/golden/NAME.png`; if it differs, the found picture is in the folder that the message names.
#[track_caller]
fn check(name: &str, found: &RgbImage) {
    let golden = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.png"));
    if std::env::var_os("AONET_UPDATE").is_some_and(|v| v == "1") {
        found.save(&golden).unwrap();
        return;
    }
    let seen = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
    let share = match image::open(&golden) {
        Ok(expected) => strays(found, &expected.to_rgb8()),
        Err(_) => 1.0,
    };
    eprintln!("{name}: {:.2} % differ", 100.0 * share);
    if share > MOST_STRAYS {
        found.save(&seen).unwrap();
        let (golden, seen) = (golden.display(), seen.display());
        panic!("{name}: {:.1} % of the pixels differ; compare {seen} with {golden}", 100.0 * share);
    }
}

#[test]
fn pictures_look_as_they_did() {
    let Some(device) = device() else { return };
    let (tracer, view) = demo(SIZE);
    let mut renderer = renderer(&device, tracer.scene(), SIZE);
    renderer.set_tracer(&tracer).unwrap();
    let plain = frame(&view);
    let split = |first, second| FrameParams { methods: [first, second], split: 0.5, ..plain };
    for (name, frame) in [
        ("shaded", plain),
        ("split", split(Method::Off, Method::Balanced)),
        ("visibility", FrameParams { show: Show::Visibility, ..split(Method::Balanced, Method::Paper) }),
        ("classic", FrameParams { show: Show::Visibility, ..split(Method::Gtao, Method::Vbao) }),
        ("error", FrameParams { show: Show::Error, samples: 16, ..split(Method::Balanced, Method::Ssao) }),
        ("normals", FrameParams { show: Show::Normals, ..plain }),
        ("second", FrameParams { show: Show::Second, ..plain }),
        ("shares", FrameParams { show: Show::Shares, separation: Some(0.1), ..plain }),
    ] {
        draw(&device, &mut renderer, &frame);
        check(name, &readback::image(&renderer).unwrap());
    }
}

#[test]
fn other_pictures_are_told_apart() {
    let grey = RgbImage::from_pixel(20, 10, Rgb([100; 3]));
    let mut changed = grey.clone();
    changed.pixels_mut().for_each(|p| p.0[1] += STEP);
    assert_eq!(strays(&changed, &grey), 0.0);
    changed.put_pixel(3, 4, Rgb([100, 90, 100]));
    assert_eq!(strays(&changed, &grey), 1.0 / 200.0);
    assert_eq!(strays(&RgbImage::new(10, 20), &grey), 1.0);
    if std::env::var_os("AONET_UPDATE").is_none() {
        assert!(std::panic::catch_unwind(|| check("no such picture", &grey)).is_err());
    }
}
