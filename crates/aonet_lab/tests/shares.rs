//! The shares of light that connected arcs find, beside exact ones, in scenes of simple shapes.

#[path = "../../aonet_scene/tests/scenes/mod.rs"]
mod scenes;

use aonet::search::{Classic, Options, Session, Share, Shares};
use aonet::{AoParams, GBuffer};
use aonet_scene::exact_shares::exact_shares;
use aonet_scene::random::Random;
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use aonet_scene::{Scene, View, gbuffer};
use glam::Vec3;
use scenes::{cuboid, floor, quad, sphere};

/// Every fourth pixel of every fourth row is compared.
const EVERY: usize = 4;

/// From above and aside.
fn view(eye: Vec3) -> View {
    let near_floor = scenes::view(eye, Vec3::Y * 0.4, 1.5);
    View { up: [0.0, 1.0, 0.0], fov_y_deg: 60.0, width: 160, height: 120, ..near_floor }
}

/// Many slices and taps, whose result is open light.
fn dense_arcs() -> Classic {
    let mut arcs = Classic::named("arcs").unwrap();
    let settings = [
        ("slices", 32.0),
        ("steps", 48.0),
        ("distribution", 1.0),
        ("angle_bias", 0.0),
        ("denoise_passes", 0.0),
    ];
    settings.iter().for_each(|(name, value)| arcs.set(name, *value).unwrap());
    arcs
}

fn with_floor(parts: &[Scene]) -> Scene {
    let mut scene = floor(20.0);
    parts.iter().for_each(|part| scene.append(part));
    scene
}

fn searched(frame: &GBuffer, radius: f32) -> Shares {
    let mut session = Session::new(&dense_arcs(), frame.window(), Options::default()).unwrap();
    session.shares(frame, AoParams::new(radius).unwrap()).unwrap()
}

/// Hit, hidden and off light, and what is open.
fn four(of: impl Fn(usize) -> f32) -> [f32; 4] {
    let [hit, hidden, off] = [of(0), of(1) + of(2) + of(3), of(4)];
    [hit, hidden, off, 1.0 - hit - hidden - off]
}

#[test]
fn shares_are_those_of_rays_with_one_layer_and_with_two() {
    let shapes = [
        ("wall", vec![quad(Vec3::new(-20.0, 0.0, -1.0), Vec3::X * 40.0, Vec3::Y * 3.0)]),
        ("sphere above a plane", vec![sphere(Vec3::Y * 0.9, 0.5, 48)]),
        ("plate above a floor", vec![quad(Vec3::new(-0.8, 0.5, -0.8), Vec3::Z * 1.6, Vec3::X * 1.6)]),
        (
            "post before a wall",
            vec![
                quad(Vec3::new(-20.0, 0.0, -1.0), Vec3::X * 40.0, Vec3::Y * 3.0),
                cuboid(Vec3::new(-0.15, 0.0, -0.3), Vec3::new(0.15, 2.0, 0.0)),
            ],
        ),
    ];
    let kinds = [None, Some(0.05)].map(|separation| Surround { margin: 0.25, separation });
    let sampling = Sampling { spp: 256, seed: 5 };
    for (name, parts) in shapes {
        let tracer = Tracer::new(with_floor(&parts));
        let view = view(Vec3::new(0.6, 2.2, 3.0));
        let (grid, exact) = exact_shares(&tracer, &view, &kinds, (sampling, EVERY)).unwrap();
        for (kind, exact) in kinds.iter().zip(&exact) {
            let frame = gbuffer::render(&tracer, &view.clone().surrounded(*kind)).unwrap().gbuffer;
            let found = searched(&frame, view.radius);
            let at = |c: usize| c * EVERY + EVERY / 2;
            let pixel = |i: usize| at(i / grid.width()) * view.width + at(i % grid.width());
            let pair = |i: usize| [four(|s| found.plane(Share::ALL[s + 1])[pixel(i)]), four(|s| exact[s][i])];
            let pairs: Vec<_> = (0..grid.pixels()).map(pair).collect();
            let mean = |of: &dyn Fn(&[[f32; 4]; 2], usize) -> f32| -> [f32; 4] {
                std::array::from_fn(|s| {
                    pairs.iter().map(|pair| of(pair, s)).sum::<f32>() / pairs.len() as f32
                })
            };
            let error = mean(&|[found, exact], s| (found[s] - exact[s]).abs());
            let [found, exact] = [0, 1].map(|k| mean(&|pair, s| pair[k][s]));
            eprintln!("{name}, {kind:?}: found {found:.4?}, exact {exact:.4?}, mean error {error:.4?}");
            // Measured, hit and hidden: 0.0119 and 0.0098 at most.
            assert!(error[0] < 0.013 && error[1] < 0.011, "{name}, {kind:?}: {error:?}");
            // Light that turns towards the camera leaves the frame farther out than the search looks.
            assert!(found[2] < exact[2] + 0.002, "{name}, {kind:?}: {} off, exact {}", found[2], exact[2]);
            if name == "plate above a floor" {
                let is_hidden = kind.separation.is_none();
                assert_eq!(found[1] > 0.01, is_hidden, "{kind:?}: {}", found[1]);
            }
        }
    }
}

#[test]
fn visibility_lies_between_open_and_not_hit_light_whatever_is_shown() {
    let mut random = Random::new(7);
    for case in 0..12 {
        let parts: Vec<Scene> = (0..8)
            .map(|_| {
                let at = Vec3::new(random.range(-1.5, 1.5), random.range(0.2, 1.0), random.range(-1.5, 1.0));
                let half = Vec3::new(
                    random.log_range(0.03, 0.6),
                    random.log_range(0.05, 0.8),
                    random.log_range(0.03, 0.6),
                );
                if random.unit() < 0.3 { sphere(at, half.x, 24) } else { cuboid(at - half, at + half) }
            })
            .collect();
        let tracer = Tracer::new(with_floor(&parts));
        let eye = Vec3::new(random.range(-2.0, 2.0), random.range(1.2, 3.0), 3.5);
        let separation = (case % 2 == 1).then_some(0.05);
        let view = view(eye).surrounded(Surround { margin: 0.1, separation });
        let surface = gbuffer::render(&tracer, &view).unwrap();
        let params = AoParams::new(view.radius).unwrap();
        let truth = reference_ao(&tracer, &surface, params, Sampling { spp: 256, seed: 1 }, &|_| {}).unwrap();
        let found = searched(&surface.gbuffer, view.radius);
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for (i, truth) in truth.visibility().iter().enumerate() {
            let [open, hit] = [Share::Open, Share::Hit].map(|share| found.plane(share)[i]);
            above.push(open - truth);
            below.push(truth - (1.0 - hit));
        }
        for (what, excess) in [("open", &mut above), ("hit", &mut below)] {
            excess.sort_by(f32::total_cmp);
            let at = |share: f32| excess[(share * (excess.len() - 1) as f32) as usize];
            eprintln!("{case}, {what}: 90 % {:.3}, 99 % {:.3}, most {:.3}", at(0.9), at(0.99), at(1.0));
            // Measured: 0.001 and 0.086; with two layers 0.116 if one plane were enough for every arc. The rest is beside silhouettes,
            // where a pixel has two depths.
            assert!(
                at(0.5) <= 0.0 && at(0.9) < 0.01 && at(0.99) < 0.11,
                "{case}, {what}: {} and {}",
                at(0.9),
                at(0.99)
            );
        }
    }
}
