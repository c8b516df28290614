//! Off-centre cameras, tiles and guard bands: what a part of a frame shows does not depend on how it is cut out.

mod common;

use aonet::net::cpu::{Options, Session};
use aonet::net::{Features, KernelWeights};
use aonet::search::Classic;
use aonet::{AoImage, AoParams, Camera, GBuffer, Margin, Size};
use common::{max_error, model, params, small, waves_seen_by};

const SIZE: Size = Size::px(208, 176);
/// A multiple of the period of the noise (5 px) and of the coarsest depths' cells (16 px).
const STEP: usize = 80;

fn whole() -> GBuffer<'static> {
    let camera = Camera::perspective(0.8, SIZE).unwrap().with_centre_px([60.25, 90.5]).unwrap();
    waves_seen_by(camera)
}

/// A part of a frame as a frame of its own.
fn tile(frame: &GBuffer, (left, top): (usize, usize), size: Size) -> GBuffer<'static> {
    let index = |i: usize| (i / size.width() + top) * frame.width() + i % size.width() + left;
    let depth: Vec<_> = (0..size.pixels()).map(|i| frame.depth()[index(i)]).collect();
    let normal: Vec<_> = (0..size.pixels()).map(|i| frame.normal()[index(i)]).collect();
    let camera = frame.camera().tile(left as isize, top as isize, size).unwrap();
    GBuffer::new(camera, depth, normal).unwrap()
}

/// Away from its edges, a tile gets the whole frame's visibility.
#[test]
fn a_tile_has_the_visibility_of_the_whole_frame() {
    let whole = whole();
    let size = Size::px(128, 96);
    let part = tile(&whole, (STEP, STEP), size);
    // At most 14 px at depth 2.6.
    let params = AoParams::new(0.2).unwrap();
    for name in ["ssao", "hbao", "ssdo", "nnao", "gtao", "vbao", "agtao"] {
        let method = Classic::named(name).unwrap();
        let (a, b) = (method.run(&whole, params).unwrap(), method.run(&part, params).unwrap());
        let (mut differences, mut seen) = (0.0, 0);
        let mut least = 1.0f32;
        for (y, x) in (32..size.height() - 32).flat_map(|y| (32..size.width() - 32).map(move |x| (y, x))) {
            let (found, expected) =
                (b.visibility()[y * size.width() + x], a.visibility()[(y + STEP) * SIZE.width() + x + STEP]);
            differences += f64::from((found - expected).abs());
            seen += 1;
            least = least.min(expected);
        }
        let mean = differences / f64::from(seen);
        // Positions round differently, so that a tap between two pixels may fall on either.
        assert!(mean < 2e-4, "{name}: {mean:e}");
        assert!(least < 0.95, "{name}: nothing to see");
    }
}

/// A camera that is off by a pixel gives another image: the test above can fail.
#[test]
fn the_centre_of_a_camera_is_noticed() {
    let whole = whole();
    let shifted = whole.camera().with_centre_px([90.25, 60.5]).unwrap();
    let other = GBuffer::new(shifted, whole.depth(), whole.normal()).unwrap();
    for name in ["gtao", "agtao", "hbao", "ssao"] {
        let method = Classic::named(name).unwrap();
        let [a, b] = [&whole, &other].map(|frame| method.run(frame, params()).unwrap());
        assert!(max_error(&a, &b) > 0.02, "{name}");
    }
}

#[test]
fn pixels_need_not_be_square() {
    // The same wall and floor, with twice as many columns.
    let method = Classic::named("agtao").unwrap();
    let camera = Camera::perspective(0.8, SIZE).unwrap();
    let wide = camera.tile(0, 0, Size::px(2 * SIZE.width(), SIZE.height())).unwrap();
    let [focal_x, focal_y] = camera.focal_px();
    let wide = wide.with_focal_px([2.0 * focal_x, focal_y]).unwrap().with_centre_px([208.0, 88.0]).unwrap();
    let corner = |camera: Camera| {
        let (mut depth, mut normal) = (Vec::new(), Vec::new());
        for i in 0..camera.size().pixels() {
            let ray = camera.position_view(i % camera.width(), i / camera.width(), 1.0);
            let floor = if ray.y < 0.0 { -0.6 / ray.y } else { f32::INFINITY };
            depth.push(floor.min(4.0));
            normal.push(if floor < 4.0 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] });
        }
        method.run(&GBuffer::new(camera, depth, normal).unwrap(), AoParams::new(1.0).unwrap()).unwrap()
    };
    let mean = |image: &AoImage| {
        image.visibility().iter().map(|v| f64::from(*v)).sum::<f64>() / image.visibility().len() as f64
    };
    let (square, anamorphic) = (mean(&corner(camera)), mean(&corner(wide)));
    assert!(square < 0.98 && (square - anamorphic).abs() < 0.002, "{square} {anamorphic}");
}

/// A guard band is read and not returned.
#[test]
fn a_margin_is_cropped() {
    let margin = Margin { x: 20, y: 13 };
    let frame = whole();
    let guarded = frame.clone().with_margin(margin).unwrap();
    let window = guarded.window();
    let cropped =
        |image: &AoImage| AoImage::new(window.size(), window.cropped(image.visibility().to_vec())).unwrap();
    for method in Classic::all() {
        let found = method.run(&guarded, params()).unwrap();
        assert_eq!(found, cropped(&method.run(&frame, params()).unwrap()), "{}", method.name());
    }
    for features in [Features::normal_projected_radius(), Features::normal_radius_horizon()] {
        let model = model(small(features, 4, KernelWeights::Linear), 3);
        let options = Options { threads: 2, ..Options::default() };
        let run = |frame: &GBuffer| {
            let mut image = AoImage::open(frame.window().size());
            let mut session = Session::with_options(&model, frame.window(), options).unwrap();
            session.run(frame, params(), &mut image).unwrap();
            image
        };
        let found = run(&guarded);
        assert_eq!(found, cropped(&run(&frame)));
        let oracle = common::oracle(&model, &guarded, params());
        assert!(max_error(&found, &oracle) < 1e-3);
        let mut session = Session::with_options(&model, SIZE, options).unwrap();
        let error = session.run(&guarded, params(), &mut AoImage::open(window.size())).unwrap_err();
        assert!(error.to_string().contains("margin of 20 columns"), "{error}");
    }
}
