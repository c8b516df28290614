//! Compares rasterised G-buffers with ray-traced ones.

mod common;

use aonet::gpu::Device;
use aonet::{GBuffer, Size};
use aonet_scene::gbuffer::{self, Surface};
use aonet_scene::scene::procedural::Kind;
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use aonet_view::renderer::readback::{self, Drawn};
use aonet_view::{FrameParams, Method};
use common::{device, draw, frame, proposed, renderer};
use glam::{Vec3, Vec3A};

/// Share of the pixels that may differ: those whose centre lies on an edge. Measured: 0.34 % at most.
const MOST_STRAYS: f32 = 0.005;
/// Largest angle between normals of a pixel that agrees (degrees).
const ANGLE_DEG: f32 = 2.0;
/// Largest difference of its depths, relative.
const DEPTH: f32 = 1e-3;

/// Pixels on which depth, or shading or geometric normals differ.
fn strays(drawn: &Drawn, cast: &Surface) -> usize {
    let (a, b): (&GBuffer, &GBuffer) = (&drawn.gbuffer, &cast.gbuffer);
    let least_cosine = ANGLE_DEG.to_radians().cos();
    let near = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).normalize().dot(Vec3::from(b)) >= least_cosine;
    let agrees = |i: &usize| match (a.is_foreground(*i), b.is_foreground(*i)) {
        (true, true) => {
            (a.depth()[*i] / b.depth()[*i] - 1.0).abs() <= DEPTH
                && near(a.normal()[*i], b.normal()[*i])
                && near(drawn.geo_normal[*i], cast.geo_normal[*i])
        }
        (drawn, cast) => drawn == cast,
    };
    (0..a.depth().len()).filter(|i| !agrees(i)).count()
}

fn drawn(device: &Device, scene: &Scene, view: &View) -> Drawn {
    let mut renderer = renderer(device, scene, view.size().unwrap());
    let frame = FrameParams { methods: [Method::Off; 2], ..frame(view) };
    draw(device, &mut renderer, &frame);
    readback::drawn(&renderer, &frame.camera).unwrap()
}

#[track_caller]
fn check(device: &Device, tracer: &Tracer, view: &View) {
    let cast = gbuffer::render(tracer, view).unwrap();
    let share =
        strays(&drawn(device, tracer.scene(), view), &cast) as f32 / (view.width * view.height) as f32;
    eprintln!("{}: {:.3} % differ", tracer.scene().name, 100.0 * share);
    assert!(share <= MOST_STRAYS, "{}: {:.3} % differ", tracer.scene().name, 100.0 * share);
}

#[test]
fn procedural_scenes() {
    let Some(device) = device() else { return };
    for kind in [Kind::FurnishedRoom, Kind::Street, Kind::Machine, Kind::Drapes, Kind::Terrain] {
        let (tracer, view) = proposed(kind, Size::px(197, 131));
        check(&device, &tracer, &view);
    }
}

#[test]
fn planes_and_parallel_rays() {
    let Some(device) = device() else { return };
    let (tracer, view) = proposed(Kind::Hall, Size::px(160, 90));
    let cast = gbuffer::render(&tracer, &view).unwrap();
    let mut depths: Vec<_> = cast.gbuffer.depth().iter().copied().filter(|d| d.is_finite()).collect();
    depths.sort_by(f32::total_cmp);
    let [near, far] = [depths[depths.len() / 4], depths[3 * depths.len() / 4]];
    assert!(near < 0.9 * far, "nothing between the planes: {near} to {far}");
    check(&device, &tracer, &View { near: 0.0, ..view.clone() });
    check(&device, &tracer, &View { near, far, ..view.clone() });
    let parallel = View { ortho_height: Some(4.0), ..view };
    check(&device, &tracer, &parallel);
    check(&device, &tracer, &View { near: 0.5, far, ..parallel });
}

#[test]
fn both_sides_of_a_triangle_and_nothing_else() {
    let Some(device) = device() else { return };
    let position = vec![Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let scene = Scene {
        position,
        normal: vec![Vec3::new(0.0, 0.6, 0.8); 3],
        triangle: vec![[0, 1, 2]],
        ..Scene::default()
    };
    for (z, front) in [(3.0, 1.0), (-3.0, -1.0)] {
        let view = View { eye: [0.0, 0.0, z], ..view_of_origin() };
        let Drawn { gbuffer, geo_normal } = drawn(&device, &scene, &view);
        let middle = 16 * 32 + 16;
        let world = |n: [f32; 3]| gbuffer.camera().view_from_world().matrix3.transpose() * Vec3A::from(n);
        assert!((gbuffer.depth()[middle] - 3.0).abs() < 1e-5);
        assert!((world(gbuffer.normal()[middle]) - front * Vec3A::new(0.0, 0.6, 0.8)).length() < 1e-3);
        assert!((world(geo_normal[middle]) - front * Vec3A::Z).length() < 1e-3);
        assert!(!gbuffer.is_foreground(0));
        check(&device, &Tracer::new(scene.clone()), &view);
    }
}

fn view_of_origin() -> View {
    let text = br#"{"eye": [0, 0, 3], "target": [0, 0, 0], "width": 32, "height": 32, "radius": 0.5}"#;
    serde_json::from_slice(text).unwrap()
}

#[test]
fn strays_are_found() {
    let (tracer, view) = proposed(Kind::Hall, Size::px(40, 30));
    let cast = gbuffer::render(&tracer, &view).unwrap();
    let same = Drawn { gbuffer: cast.gbuffer.clone(), geo_normal: cast.geo_normal.clone() };
    assert_eq!(strays(&same, &cast), 0);
    let pixel = (0..1200).find(|i| cast.gbuffer.is_foreground(*i)).unwrap();
    let changed = |depth: f32, turn: f32, geo_turn: f32| {
        let turned = |n: [f32; 3], angle: f32| {
            let n = Vec3::from(n);
            (n + n.any_orthonormal_vector() * angle.to_radians().tan()).normalize().to_array()
        };
        let mut drawn = same.clone();
        let (mut depths, mut normals) = (same.gbuffer.depth().to_vec(), same.gbuffer.normal().to_vec());
        depths[pixel] *= depth;
        normals[pixel] = turned(normals[pixel], turn);
        drawn.geo_normal[pixel] = turned(drawn.geo_normal[pixel], geo_turn);
        drawn.gbuffer = GBuffer::new(*same.gbuffer.camera(), depths, normals).unwrap();
        strays(&drawn, &cast)
    };
    assert_eq!(changed(1.0005, 1.5, 1.5), 0);
    assert_eq!([changed(1.002, 0.0, 0.0), changed(1.0, 3.0, 0.0), changed(1.0, 0.0, 3.0)], [1; 3]);
    assert_eq!(changed(f32::INFINITY, 0.0, 0.0), 1);
}
