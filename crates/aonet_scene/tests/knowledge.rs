//! What frames of scenes know in closed form.

mod scenes;

use aonet_scene::knowledge::{Knowledge, knowledge};
use aonet_scene::reference::Sampling;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use aonet_scene::{Scene, View};
use glam::Vec3;
use scenes::{floor, quad, view};

const SAMPLING: Sampling = Sampling { spp: 256, seed: 3 };
const ONE_LAYER: Surround = Surround { margin: 0.0, separation: None };

fn known(scene: Scene, view: &View, kinds: &[Surround]) -> Knowledge {
    knowledge(&Tracer::new(scene), view, kinds, (SAMPLING, 4)).unwrap()
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// The floor from above.
fn from_above() -> View {
    View { fov_y_deg: 60.0, width: 64, height: 48, ..view(Vec3::Y * 4.0, Vec3::ZERO, 1.0) }
}

/// A wall of height 1 that stands at a distance from the origin.
fn walled(distance: f32) -> Scene {
    let mut scene = floor(10.0);
    scene.append(&quad(Vec3::new(-1e3, 0.0, -distance), Vec3::X * 2e3, Vec3::Y));
    scene
}

#[test]
fn a_wall_out_of_the_frame_is_not_known() {
    let view = view(Vec3::new(0.0, 0.5, 0.3), Vec3::ZERO, 1e4);
    let found = known(walled(1.0), &view, &[ONE_LAYER]);
    let expected = 0.5 * (1.0 + 0.5f32.sqrt());
    assert!((mean(&found.visibility) - expected).abs() < 0.01, "{:?}", found.visibility);
    assert_eq!(mean(&found.hit[0]), 0.0);
}

#[test]
fn a_guard_band_shows_what_stands_beside_the_picture() {
    // The picture shows |z| < 2.31 of the floor; the wall stands just outside of it.
    let wall = walled(2.4);
    let kinds = [0.0, 0.2].map(|margin| Surround { margin, ..ONE_LAYER });
    let view = View { up: [0.0, 0.0, -1.0], ..from_above() };
    let found = known(wall, &view, &kinds);
    let lost = 1.0 - mean(&found.visibility);
    assert!(lost > 0.005, "{lost}");
    assert_eq!(mean(&found.hit[0]), 0.0);
    assert!((mean(&found.hit[1]) - lost).abs() < 1e-6, "{:?} of {lost}", mean(&found.hit[1]));
    assert!(found.psnr(1) > 100.0 && found.psnr(0) < 50.0);
}

#[test]
fn a_second_layer_shows_what_a_plate_hides() {
    let plate = |height: f32| quad(Vec3::new(-1.0, height, -5.0), Vec3::Z * 10.0, Vec3::X);
    let mut scene = floor(10.0);
    scene.append(&plate(0.6));
    scene.append(&plate(0.2));
    let kinds = [None, Some(0.1), Some(0.5)].map(|separation| Surround { margin: 1.0, separation });
    let found = known(scene, &from_above(), &kinds);
    let lost = 1.0 - mean(&found.visibility);
    let [one, two, too_far] = [0, 1, 2].map(|kind| mean(&found.hit[kind]));
    // The lower plate is 0.4 behind the upper one.
    assert!((two - lost).abs() < 1e-6 && one < 0.8 * lost && one > 0.2 * lost, "{one}, {two} of {lost}");
    assert!((too_far - one).abs() < 1e-6, "{too_far}, {one}");
}

#[test]
fn what_is_out_of_range_is_refused() {
    let tracer = Tracer::new(floor(1.0));
    let refused = |kind: Surround, every| {
        knowledge(&tracer, &from_above(), &[kind], (SAMPLING, every)).unwrap_err().to_string()
    };
    assert!(refused(ONE_LAYER, 0).contains("distance of pixels"));
    assert!(refused(Surround { margin: -1.0, ..ONE_LAYER }, 1).contains("margin"));
}
