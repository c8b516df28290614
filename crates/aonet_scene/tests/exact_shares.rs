//! Exact shares of light in scenes where they are known.

mod scenes;

use aonet_scene::exact_shares::{ExactShares, exact_shares};
use aonet_scene::knowledge::knowledge;
use aonet_scene::reference::Sampling;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use aonet_scene::{Scene, View};
use glam::Vec3;
use scenes::{floor, quad, view};

const SAMPLING: Sampling = Sampling { spp: 256, seed: 3 };
const ONE_LAYER: Surround = Surround { margin: 0.0, separation: None };

/// The floor from above: the picture shows |x| < 3.08 and |z| < 2.31.
fn from_above() -> View {
    View {
        up: [0.0, 0.0, -1.0],
        fov_y_deg: 60.0,
        width: 64,
        height: 48,
        ..view(Vec3::Y * 4.0, Vec3::ZERO, 1.0)
    }
}

fn shares(scene: Scene, kinds: &[Surround]) -> Vec<ExactShares> {
    let (size, found) = exact_shares(&Tracer::new(scene), &from_above(), kinds, (SAMPLING, 4)).unwrap();
    assert_eq!((size.width(), size.height()), (16, 12));
    found
}

/// Mean of each share, and of all hidden ones.
fn means(shares: &ExactShares) -> ([f32; 5], f32) {
    let means = shares.each_ref().map(|plane| plane.iter().sum::<f32>() / plane.len() as f32);
    (means, means[1] + means[2] + means[3])
}

#[test]
fn all_light_of_a_wide_floor_is_open_but_at_the_border() {
    let found = shares(floor(10.0), &[ONE_LAYER, Surround { margin: 0.5, ..ONE_LAYER }]);
    let ([hit, .., off], hidden) = means(&found[0]);
    assert_eq!((hit, hidden), (0.0, 0.0));
    assert!(off > 0.05 && off < 0.5, "{off}");
    // Columns 2, 6, …: the middle is further than the radius from every border, the first column is not.
    let row = 6 * 16;
    assert!(found[0][4][row + 8] == 0.0 && found[0][4][row] > 0.3, "{:?}", &found[0][4][row..row + 16]);
    assert!(means(&found[1]).0.iter().all(|share| *share == 0.0), "a guard band shows the rest");
}

#[test]
fn light_passes_behind_a_plate_unless_a_second_layer_shows_what_is_there() {
    let mut scene = floor(10.0);
    scene.append(&quad(Vec3::new(-0.4, 0.3, -9.0), Vec3::Z * 18.0, Vec3::X * 0.8));
    let kinds = [None, Some(0.1)].map(|separation| Surround { margin: 1.0, separation });
    let found = shares(scene.clone(), &kinds);
    let known = knowledge(&Tracer::new(scene), &from_above(), &kinds, (SAMPLING, 4)).unwrap();
    for (kind, found) in found.iter().enumerate() {
        assert_eq!(found[0], known.hit[kind], "what is hit is what is known");
    }
    let (one_layer, hidden) = means(&found[0]);
    let [_, close, middle, deep, off] = one_layer;
    // The floor is 0.3 of the radius below the plate: hardly anything above it is behind the plate by more.
    assert!(close > 0.002 && middle > 0.002 && deep < 0.1 * hidden && off == 0.0, "{one_layer:?}");
    // The floor below the plate is seen; what is less than the separation behind the plate is not.
    let two_layers = means(&found[1]).0;
    let [_, close_behind, middle, deep, off] = two_layers;
    assert!(close_behind > 0.0 && close_behind <= close, "{two_layers:?}, with one layer {close}");
    assert_eq!((middle, deep, off), (0.0, 0.0, 0.0));
}

#[test]
fn what_is_out_of_range_is_refused() {
    let refused = |kind: Surround, every| {
        let tracer = Tracer::new(floor(1.0));
        exact_shares(&tracer, &from_above(), &[kind], (SAMPLING, every)).unwrap_err().to_string()
    };
    assert!(refused(ONE_LAYER, 0).contains("distance of pixels"));
    assert!(refused(Surround { margin: -1.0, ..ONE_LAYER }, 1).contains("margin"));
}
