//! Frame files: written files are read back, and other programs' files are read correctly.

use aonet::{AoImage, Camera, GBuffer, Margin, SecondLayer, Size};
use aonet_lab::frame::{Frame, FrameHints};
use aonet_scene::View;
use glam::Vec3;
use std::path::PathBuf;

/// Half floats have 11 significant bits: half a step below 1.
const HALF_STEP: f32 = 1.0 / 4096.0;

fn view(width: usize, height: usize) -> View {
    let json = format!(
        r#"{{"eye":[0.3,1.1,3],"target":[0.1,0.2,-0.4],"fov_y_deg":47,"width":{width},"height":{height},"near":0.05,"radius":0.7}}"#
    );
    serde_json::from_str(&json).unwrap()
}

/// Bumpy normals, uneven depth, every seventh pixel background.
fn frame(width: usize, height: usize) -> Frame {
    let camera = view(width, height).camera().unwrap();
    let mut depth = Vec::new();
    let mut normal = Vec::new();
    let mut geo_normal = Vec::new();
    let mut ao = Vec::new();
    for i in 0..width * height {
        let to_viewer = camera.to_viewer(camera.position_view(i % width, i / width, 1.0));
        let bump = 0.4 * Vec3::new((i as f32 * 0.1).sin(), (i as f32 * 0.23).cos(), 0.0);
        let n = (Vec3::from(to_viewer) + bump).normalize();
        let background = i % 7 == 3;
        depth.push(if background { f32::INFINITY } else { 2.0 + (i as f32 * 0.37).sin() });
        normal.push(if background { [0.0; 3] } else { n.to_array() });
        geo_normal.push(if background { [0.0; 3] } else { Vec3::Z.to_array() });
        ao.push(if background { 1.0 } else { 0.5 + 0.5 * (i as f32).sin() });
    }
    Frame {
        gbuffer: GBuffer::new(camera, depth, normal).unwrap(),
        geo_normal: Some(geo_normal),
        ao: Some(AoImage::new(Size::px(width, height), ao).unwrap()),
        radius: Some(0.7),
        view: Some(view(width, height)),
    }
}

fn assert_close(a: &Frame, b: &Frame) {
    assert_eq!(a.gbuffer.camera(), b.gbuffer.camera());
    assert_eq!(a.gbuffer.depth(), b.gbuffer.depth());
    let vectors = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let worst =
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(a.len() == b.len() && worst <= 2.0 * HALF_STEP, "{worst}");
    };
    vectors(a.gbuffer.normal(), b.gbuffer.normal());
    assert_eq!(a.geo_normal.is_some(), b.geo_normal.is_some());
    if let (Some(a), Some(b)) = (&a.geo_normal, &b.geo_normal) {
        vectors(a, b);
    }
    assert_eq!(a.ao.is_some(), b.ao.is_some());
    if let (Some(a), Some(b)) = (&a.ao, &b.ao) {
        assert!(a.visibility().iter().zip(b.visibility()).all(|(a, b)| (a - b).abs() <= HALF_STEP));
    }
    assert_eq!((a.radius, &a.view), (b.radius, &b.view));
}

#[test]
fn a_frame_survives_its_file_at_any_size() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in [(1, 1), (7, 3), (64, 33), (4001, 17), (17, 1031)] {
        let path = folder.path().join(format!("{width}.exr"));
        let original = frame(width, height);
        original.save(&path).unwrap();
        let loaded = Frame::load(&path, &FrameHints::default()).unwrap();
        assert_close(&original, &loaded);
    }
}

#[test]
fn optional_parts_may_be_absent() {
    let original = Frame { geo_normal: None, ao: None, radius: None, view: None, ..frame(9, 5) };
    let loaded = Frame::from_bytes(&original.to_bytes().unwrap(), &FrameHints::default()).unwrap();
    assert_close(&original, &loaded);
    let camera = Camera::orthographic(3.0, Size::px(2, 1)).unwrap().with_near(0.25).unwrap();
    let camera = camera.looking_at([1.0, 2.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0]).unwrap();
    let camera = camera.with_centre_px([1.5, 0.25]).unwrap();
    let gbuffer = GBuffer::new(camera, vec![1.0; 2], vec![[0.0, 0.0, 1.0]; 2]).unwrap();
    let original = Frame { gbuffer, geo_normal: None, ao: None, radius: Some(2.0), view: None };
    let loaded = Frame::from_bytes(&original.to_bytes().unwrap(), &FrameHints::default()).unwrap();
    assert_eq!(original, loaded);
}

#[test]
fn a_gbuffer_alone_is_that_of_the_frame() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f.exr");
    // More rows than are decoded at once.
    frame(37, 601).save(&path).unwrap();
    let whole = Frame::load(&path, &FrameHints::default()).unwrap();
    let alone = Frame::load_gbuffer(&path, None, &FrameHints::default()).unwrap();
    assert!(whole.ao.is_some() && whole.geo_normal.is_some());
    assert_eq!(alone, Frame { ao: None, geo_normal: None, ..whole });
}

#[test]
fn a_margin_and_a_second_layer_survive() {
    let inner = frame(30, 20);
    let margin = Margin { x: 5, y: 3 };
    let camera = view(30, 20).camera().unwrap().with_margin(margin).unwrap();
    let pixels = camera.size().pixels();
    let depth: Vec<f32> =
        (0..pixels).map(|i| if i % 9 == 4 { f32::INFINITY } else { 1.0 + i as f32 }).collect();
    let facing = |i: usize| {
        let at = camera.position_view(i % camera.width(), i / camera.width(), 1.0);
        camera.to_viewer(at).to_array()
    };
    let normal: Vec<_> = (0..pixels).map(facing).collect();
    let second: Vec<f32> =
        depth.iter().map(|d| if *d as usize % 5 == 2 { f32::INFINITY } else { d + 0.5 }).collect();
    let gbuffer = GBuffer::new(camera, depth, normal.clone()).unwrap().with_margin(margin).unwrap();
    let layer = SecondLayer { depth: second.into(), normal: Some(normal.into()) };
    let gbuffer = gbuffer.with_second(layer).unwrap();
    let shown = gbuffer.foreground().into_iter().enumerate();
    let ao = shown.map(|(i, shown)| if shown { i as f32 / 600.0 } else { 1.0 }).collect();
    let ao = Some(AoImage::new(Size::px(30, 20), ao).unwrap());
    let view = View { margin: 0.15, separation: Some(0.1), ..view(30, 20) };
    let original = Frame { gbuffer, geo_normal: None, ao, view: Some(view), ..inner };
    let loaded = Frame::from_bytes(&original.to_bytes().unwrap(), &FrameHints::default()).unwrap();
    assert_close(&original, &loaded);
    assert_eq!((loaded.gbuffer.window(), &loaded.view), (original.gbuffer.window(), &original.view));
    let [a, b] = [&original, &loaded].map(|frame| frame.gbuffer.second().unwrap());
    assert_eq!(a.depth, b.depth);
    let normals = [a, b].map(|layer| layer.normal.as_ref().unwrap().as_flattened());
    assert!(normals[0].iter().zip(normals[1]).all(|(a, b)| (a - b).abs() <= 2.0 * HALF_STEP));
    let without_view = Frame { view: None, ..original };
    let loaded = Frame::from_bytes(&without_view.to_bytes().unwrap(), &FrameHints::default()).unwrap();
    assert_eq!(loaded.gbuffer.window(), without_view.gbuffer.window());
    assert_eq!(loaded.gbuffer.camera().focal_px(), without_view.gbuffer.camera().focal_px());
}

#[test]
fn equal_frames_give_equal_bytes() {
    let bytes = frame(65, 40).to_bytes().unwrap();
    for _ in 0..8 {
        assert_eq!(frame(65, 40).to_bytes().unwrap(), bytes);
    }
}

#[test]
fn hints_win_over_the_file() {
    let bytes = frame(8, 8).to_bytes().unwrap();
    let hints = FrameHints { radius: Some(0.2), fov_y_deg: Some(30.0), ..Default::default() };
    let loaded = Frame::from_bytes(&bytes, &hints).unwrap();
    assert_eq!(loaded.radius, Some(0.2));
    assert_eq!(loaded.view.as_ref().map(|v| (v.radius, v.fov_y_deg)), Some((0.2, 30.0)));
    let fov_y = 30f32.to_radians();
    let expected = Camera::perspective(fov_y, Size::px(8, 8)).unwrap();
    assert_eq!(loaded.gbuffer.camera().focal_px(), expected.focal_px());
    let hints = FrameHints { view: Some(view(16, 8)), ..Default::default() };
    let message = Frame::from_bytes(&bytes, &hints).unwrap_err().to_string();
    assert!(message.contains("16x8") && message.contains("8x8"), "{message}");
}

/// Frames of another program; skipped without `AONET_DATA`.
#[test]
fn reference_frames_load() {
    let Some(data) = std::env::var_os("AONET_DATA").map(PathBuf::from) else {
        eprintln!("skipped: AONET_DATA is not set");
        return;
    };
    let view = View::load(&data.join("reference-frames/room.json")).unwrap();
    let path = data.join("reference-frames/room.exr");
    let no_camera = Frame::load(&path, &FrameHints::default()).unwrap_err().to_string();
    assert!(no_camera.contains("room.exr") && no_camera.contains("field of view"), "{no_camera}");
    let hints = FrameHints { fov_y_deg: Some(60.0), ..Default::default() };
    let by_angle = Frame::load(&path, &hints).unwrap();
    let by_view = Frame::load(&path, &FrameHints { view: Some(view), ..Default::default() }).unwrap();
    assert_eq!(by_angle.gbuffer.depth(), by_view.gbuffer.depth());
    assert_eq!(by_angle.gbuffer.normal(), by_view.gbuffer.normal());
    assert_eq!((by_view.gbuffer.width(), by_view.gbuffer.height()), (1280, 720));
    let ao = by_view.ao.unwrap();
    let mean = ao.visibility().iter().sum::<f32>() / (1280.0 * 720.0);
    assert!(mean > 0.3 && mean < 1.0, "{mean}");
    assert_eq!((by_view.radius, by_angle.radius), (Some(1.0), None));
}

/// A folder with a frame, and a second file beside it.
struct Pair {
    folder: tempfile::TempDir,
    first: Frame,
}

impl Pair {
    fn new() -> Self {
        let (folder, first) = (tempfile::tempdir().unwrap(), frame(16, 8));
        first.save(&folder.path().join("first.exr")).unwrap();
        Self { folder, first }
    }

    /// The frame with a second file, whose depths are those of the frame after `depth`.
    fn with(&self, depth: impl Fn(usize, f32) -> f32) -> aonet_scene::Result<Frame> {
        let first = &self.first.gbuffer;
        let depths: Vec<f32> = first.depth().iter().enumerate().map(|(i, d)| depth(i, *d)).collect();
        let facing = |n: &[f32; 3]| if *n == [0.0; 3] { [0.0, 0.0, 1.0] } else { *n };
        let normals: Vec<_> = first.normal().iter().map(facing).collect();
        let gbuffer = GBuffer::new(*first.camera(), depths, normals).unwrap();
        self.with_frame(&Frame { gbuffer, geo_normal: None, ao: None, ..self.first.clone() })
    }

    fn with_frame(&self, second: &Frame) -> aonet_scene::Result<Frame> {
        self.with_bytes(&second.to_bytes().unwrap())
    }

    fn with_bytes(&self, bytes: &[u8]) -> aonet_scene::Result<Frame> {
        let path = |name: &str| self.folder.path().join(name);
        std::fs::write(path("second.exr"), bytes).unwrap();
        Frame::load_with_second(&path("first.exr"), &path("second.exr"), &FrameHints::default())
    }
}

#[test]
fn a_second_file_is_the_second_layer() {
    let pair = Pair::new();
    // Equal depths are allowed: where nothing was hidden both files show the same surface.
    let found = pair.with(|i, d| d + (i % 3) as f32).unwrap();
    let second = found.gbuffer.second().unwrap();
    for (i, first) in pair.first.gbuffer.depth().iter().enumerate() {
        assert_eq!(second.depth[i], first + (i % 3) as f32, "{i}");
    }
    let (normal, expected) = (second.normal.as_ref().unwrap(), pair.first.gbuffer.normal());
    let apart = normal.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f32::max) <= 2.0 * HALF_STEP);
    assert_eq!((found.ao.is_some(), found.radius), (true, Some(0.7)));
    // The layers of a file with both are its own until another file is given.
    let again = Frame::from_bytes(&found.to_bytes().unwrap(), &FrameHints::default()).unwrap();
    assert_eq!(again.gbuffer.second().unwrap().depth, second.depth);
    let rounded = pair.with(|_, d| d * 0.99999).unwrap();
    assert_eq!(rounded.gbuffer.second().unwrap().depth, pair.first.gbuffer.depth());
    // Nothing behind anything.
    let none = pair.with(|_, _| f32::INFINITY).unwrap();
    assert!(none.gbuffer.second().unwrap().depth.iter().all(|d| d.is_infinite()));
}

#[test]
fn second_files_that_do_not_fit_are_refused_with_their_name() {
    let pair = Pair::new();
    let refused = |found: aonet_scene::Result<Frame>, words: &[&str]| {
        let message = found.unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    };
    let in_front = pair.with(|i, d| if i == 21 { 0.999 * d } else { d });
    refused(in_front, &["second.exr", "second depth at (5, 1)", "at least the first depth"]);
    // The first layer shows the background there.
    refused(pair.with(|i, d| if i == 3 { 9.0 } else { d }), &["second.exr", "(3, 0)"]);
    refused(pair.with_frame(&frame(16, 9)), &["second.exr", "16x8", "16x9"]);
    let margin = Margin { x: 2, y: 1 };
    let wide = frame(16, 8).gbuffer.with_margin(margin).unwrap();
    let wide = Frame { gbuffer: wide, geo_normal: None, ao: None, radius: None, view: None };
    refused(pair.with_frame(&wide), &["second.exr", "16x8"]);
    refused(pair.with_bytes(b"no image"), &["second.exr"]);
    let path = pair.folder.path();
    let absent =
        Frame::load_with_second(&path.join("first.exr"), &path.join("no.exr"), &FrameHints::default());
    refused(absent, &["no.exr"]);
}
