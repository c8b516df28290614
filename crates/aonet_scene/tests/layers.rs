//! Second layers of scenes of which they are known in closed form.

use aonet_scene::gbuffer::{Surface, render};
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use glam::Vec3;

mod scenes;
use scenes::{cuboid, floor, quad, sphere, view};

/// Height of the camera above the floor.
const EYE: f32 = 4.0;

/// `scene` from above.
fn from_above(scene: Scene, separation: f32) -> Surface {
    let view = View { separation: Some(separation), ..view(Vec3::Y * EYE, Vec3::ZERO, 1.0) };
    render(&Tracer::new(scene), &view).unwrap()
}

fn with_floor(mut scene: Scene) -> Scene {
    scene.append(&floor(10.0));
    scene
}

/// A horizontal plate of no thickness, visible from both sides.
fn plate(height: f32) -> Scene {
    quad(Vec3::new(-1.0, height, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0)
}

#[track_caller]
fn check(surface: &Surface, (first, second): (f32, f32)) {
    let layer = surface.gbuffer.second().unwrap();
    for (i, (found, behind)) in surface.gbuffer.depth().iter().zip(layer.depth.iter()).enumerate() {
        assert!((found - first).abs() < 1e-4, "pixel {i}: first layer at {found}, not at {first}");
        let same = *behind == second || (behind - second).abs() < 1e-4;
        assert!(same, "pixel {i}: second layer at {behind}, not at {second}");
    }
}

#[test]
fn a_floor_alone_has_nothing_behind_it() {
    let surface = from_above(floor(10.0), 0.1);
    check(&surface, (EYE, f32::INFINITY));
    let normal = surface.gbuffer.second().unwrap().normal.clone().unwrap();
    assert!(normal.iter().all(|n| *n == [0.0; 3]));
}

#[test]
fn a_floor_lies_behind_a_plate() {
    let surface = from_above(with_floor(plate(1.0)), 0.1);
    check(&surface, (EYE - 1.0, EYE));
    // Both face the camera.
    let normal = surface.gbuffer.second().unwrap().normal.clone().unwrap();
    assert!(normal.iter().all(|n| n[2] > 0.999), "{normal:?}");
}

#[test]
fn surfaces_within_the_separation_are_skipped() {
    let mut scene = with_floor(plate(1.0));
    scene.append(&plate(0.95));
    check(&from_above(scene.clone(), 0.0), (EYE - 1.0, EYE - 0.95));
    check(&from_above(scene.clone(), 0.04), (EYE - 1.0, EYE - 0.95));
    check(&from_above(scene, 0.06), (EYE - 1.0, EYE));
}

#[test]
fn the_inside_of_a_closed_surface_counts() {
    let scene = with_floor(cuboid(Vec3::new(-1.0, 0.5, -1.0), Vec3::new(1.0, 1.0, 1.0)));
    check(&from_above(scene.clone(), 0.1), (EYE - 1.0, EYE - 0.5));
    check(&from_above(scene, 0.6), (EYE - 1.0, EYE));
}

#[test]
fn layers_and_guard_band_cover_the_same_pixels() {
    let scene = with_floor(sphere(Vec3::Y, 0.5, 32));
    let wide =
        View { fov_y_deg: 60.0, width: 48, height: 32, ..view(Vec3::new(0.0, 2.0, EYE), Vec3::Y, 1.0) };
    let flat = render(&Tracer::new(scene.clone()), &wide).unwrap();
    let deep = render(&Tracer::new(scene), &View { margin: 0.4, separation: Some(0.1), ..wide }).unwrap();
    let window = deep.gbuffer.window();
    assert_eq!(window.cropped(deep.gbuffer.depth().to_vec()), flat.gbuffer.depth());
    let second = deep.gbuffer.second().unwrap();
    assert_eq!(second.depth.len(), window.buffer_size().pixels());
    let gaps = deep.gbuffer.depth().iter().zip(second.depth.iter()).filter(|(d, _)| d.is_finite());
    assert!(gaps.clone().all(|(first, second)| second - first >= 0.1 - 1e-5));
    assert!(gaps.filter(|(_, second)| second.is_finite()).count() > 20);
}

#[test]
fn separations_out_of_range_are_refused() {
    for separation in [-0.1, f32::NAN, 1e9] {
        let view = View { separation: Some(separation), ..view(Vec3::Y * EYE, Vec3::ZERO, 1.0) };
        let message = render(&Tracer::new(floor(1.0)), &view).unwrap_err().to_string();
        assert!(message.contains("separation"), "{message}");
    }
}
