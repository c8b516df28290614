//! Compares rasterised G-buffers with ray-traced ones.

mod common;

use aonet::gpu::Device;
use aonet::{GBuffer, SecondLayer, Size};
use aonet_scene::gbuffer::{self, Surface};
use aonet_scene::scene::procedural::Kind;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use aonet_scene::{Scene, View};
use aonet_view::renderer::readback::{self, Drawn};
use aonet_view::{FrameParams, Method};
use common::{device, draw, frame, proposed, renderer, window};
use glam::{Vec3, Vec3A};

/// Share of the pixels that may differ: those whose centre lies on an edge. Measured: 0.34 % at most.
const MOST_STRAYS: f32 = 0.005;
/// Largest angle between normals of a pixel that agrees (degrees).
const ANGLE_DEG: f32 = 2.0;
/// Largest difference of its depths, relative.
const DEPTH: f32 = 1e-3;

/// Whether two unit vectors agree.
fn is_near(a: [f32; 3], b: [f32; 3]) -> bool {
    Vec3::from(a).normalize().dot(Vec3::from(b)) >= ANGLE_DEG.to_radians().cos()
}

/// Whether two depths agree, and if they are of surfaces, `also` holds.
fn agree(a: f32, b: f32, also: impl Fn() -> bool) -> bool {
    match (a.is_finite(), b.is_finite()) {
        (true, true) => (a / b - 1.0).abs() <= DEPTH && also(),
        (a, b) => a == b,
    }
}

/// Pixels on which depth, or shading or geometric normals differ.
fn strays(drawn: &Drawn, cast: &Surface) -> usize {
    let (a, b): (&GBuffer, &GBuffer) = (&drawn.gbuffer, &cast.gbuffer);
    let agrees = |i: &usize| {
        agree(a.depth()[*i], b.depth()[*i], || {
            is_near(a.normal()[*i], b.normal()[*i]) && is_near(drawn.geo_normal[*i], cast.geo_normal[*i])
        })
    };
    (0..a.depth().len()).filter(|i| !agrees(i)).count()
}

/// Pixels on which depth or normals of the second layer differ.
fn second_strays(a: &SecondLayer, b: &SecondLayer) -> usize {
    let (Some(normal_a), Some(normal_b)) = (&a.normal, &b.normal) else { panic!("no second normals") };
    let agrees = |i: &usize| agree(a.depth[*i], b.depth[*i], || is_near(normal_a[*i], normal_b[*i]));
    (0..a.depth.len()).filter(|i| !agrees(i)).count()
}

fn drawn(device: &Device, scene: &Scene, view: &View) -> Drawn {
    let mut renderer = renderer(device, scene, window(view));
    let frame = FrameParams { methods: [Method::Off; 2], ..frame(view) };
    draw(device, &mut renderer, &frame);
    readback::drawn(&renderer, &frame.camera).unwrap()
}

#[track_caller]
fn check(device: &Device, tracer: &Tracer, view: &View) {
    let cast = gbuffer::render(tracer, view).unwrap();
    let drawn = drawn(device, tracer.scene(), view);
    assert_eq!(drawn.gbuffer.window(), cast.gbuffer.window());
    let (a, b) = (drawn.gbuffer.second(), cast.gbuffer.second());
    assert_eq!(a.is_some(), b.is_some());
    let behind = a.zip(b).map(|(a, b)| ("second layer", second_strays(a, b)));
    for (layer, strays) in [("first layer", strays(&drawn, &cast))].into_iter().chain(behind) {
        let share = strays as f32 / cast.gbuffer.size().pixels() as f32;
        eprintln!("{}: {:.3} % of the {layer} differ", tracer.scene().name, 100.0 * share);
        assert!(share <= MOST_STRAYS, "{}: {:.3} % of the {layer}", tracer.scene().name, 100.0 * share);
    }
}

/// A view with a guard band and a second layer.
fn deep(view: View, separation: f32) -> View {
    view.surrounded(Surround { margin: 0.15, separation: Some(separation) })
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
fn procedural_scenes_with_a_guard_band_and_a_second_layer() {
    let Some(device) = device() else { return };
    for kind in [Kind::FurnishedRoom, Kind::Street, Kind::Machine, Kind::Drapes, Kind::Terrain] {
        let (tracer, view) = proposed(kind, Size::px(197, 131));
        for separation in [0.0, 0.1, 0.5] {
            check(&device, &tracer, &deep(view.clone(), separation));
        }
    }
}

/// The second layer of a surface without thickness is what is behind it, whatever side of it is seen.
#[test]
fn front_and_back_faces_can_be_behind() {
    let Some(device) = device() else { return };
    let square =
        |z: f32| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z));
    let triangle = (0..3).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
    let scene = Scene {
        position: [0.0, -0.02, -1.0].into_iter().flat_map(square).collect(),
        normal: vec![Vec3::Z; 12],
        triangle: triangle.collect(),
        ..Scene::default()
    };
    let middle = |view: &View| {
        let drawn = drawn(&device, &scene, view);
        let (gbuffer, middle) = (&drawn.gbuffer, drawn.gbuffer.size().pixels() / 2 + 20);
        (gbuffer.depth()[middle], gbuffer.second().unwrap().depth[middle])
    };
    // The radius is 0.5: the middle square is nearer to the first one than the larger separation.
    for (eye, separation, depths) in [
        (3.0, 0.01, (3.0, 3.02)),
        (3.0, 0.1, (3.0, 4.0)),
        (-3.0, 0.1, (2.0, 2.98)),
        (-3.0, 3.0, (2.0, f32::INFINITY)),
    ] {
        let view = deep(View { eye: [0.0, 0.0, eye], ..view_of_origin() }, separation);
        let (first, second) = middle(&view);
        let is_near = |a: f32, b: f32| a == b || (a - b).abs() < 1e-4;
        assert!(
            is_near(first, depths.0) && is_near(second, depths.1),
            "{eye} {separation}: {first} {second}"
        );
        check(&device, &Tracer::new(scene.clone()), &view);
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
    let parallel = View { ortho_height: Some(4.0), ..view.clone() };
    check(&device, &tracer, &parallel);
    check(&device, &tracer, &View { near: 0.5, far, ..parallel.clone() });
    check(&device, &tracer, &deep(View { near: 0.5, far, ..parallel }, 0.1));
    check(&device, &tracer, &deep(View { near, far, ..view }, 0.1));
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

#[test]
fn strays_of_the_second_layer_are_found() {
    let (tracer, view) = proposed(Kind::Hall, Size::px(40, 30));
    let cast = gbuffer::render(&tracer, &deep(view, 0.1)).unwrap();
    let same = cast.gbuffer.second().unwrap().clone();
    assert_eq!(second_strays(&same, &same), 0);
    let pixel = same.depth.iter().position(|depth| depth.is_finite()).unwrap();
    let changed = |depth: f32, normal: Option<[f32; 3]>| {
        let mut other = same.clone();
        other.depth.to_mut()[pixel] *= depth;
        let normals = other.normal.as_mut().unwrap().to_mut();
        normals[pixel] = normal.unwrap_or(normals[pixel]);
        second_strays(&other, &same)
    };
    let normal = Vec3::from(same.normal.as_ref().unwrap()[pixel]).any_orthonormal_vector();
    assert_eq!(changed(1.0005, None), 0);
    assert_eq!(
        [changed(1.002, None), changed(f32::INFINITY, None), changed(1.0, Some(normal.into()))],
        [1; 3]
    );
}
