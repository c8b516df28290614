//! The runtime's search and features against the oracle's, which are written from their definitions.

mod common;

use aonet::internals::features::write_features;
use aonet::internals::naive::{self, Planes};
use aonet::internals::weights::Weights;
use aonet::net::cpu::{Options, Precision, Session};
use aonet::net::{Channel, Features, Model, ModelConfig, SearchConfig, TrainingFacts};
use aonet::search::{self, AgtaoParams, ArcsParams, Classic, VbaoParams};
use aonet::simd::Level;
use aonet::{AoImage, BentNormals, GBuffer, Projection, Size, glam};
use common::{behind_bars, frame, model, params, survey, surveying, waves, waves_through};

/// Largest difference of a feature, over its size where that is more than 1. Measured: 1.2e-7.
const FEATURE_TOLERANCE: f32 = 1e-6;

/// Largest difference of a visibility where all taps fall on the same pixels. Measured: 3.4e-5 with AVX-512, whose reciprocal
/// root is off by 6e-5, and 1.8e-5 without.
const SEARCH_TOLERANCE: f32 = 1e-4;

/// Share of the pixels that may differ by more: a tap between two pixels falls on either, and an occluder at the edge of the
/// radius counts or does not. Measured: 0.0018 with depths at random, none on a surface.
const FLIPPED_SHARE: f32 = 0.004;

/// Mean difference of the visibility that connected arcs find: angles fall into one sector or the next. Measured: 2.2e-4 through
/// an oblique lens, 1.2e-4 with depths at random, else 3e-5.
const ARCS_TOLERANCE: f32 = 4e-4;

#[test]
fn features_are_those_of_their_definitions() {
    let mut all: Vec<_> = Channel::all().collect();
    all.retain(|channel| channel.search_plane().is_none());
    let features = Features::new(all);
    for gbuffer in frames() {
        let (width, height) = (gbuffer.width(), gbuffer.height());
        let mut found = vec![f32::NAN; features.channels().len() * width * height];
        write_features(&features, &gbuffer, params(), &[], &mut found);
        let expected = naive::features(&features, &gbuffer, params(), None).values;
        for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
            let off = (a - b).abs() / b.abs().max(1.0);
            let channel = features.channels()[i / (width * height)];
            assert!(off <= FEATURE_TOLERANCE, "{}: {a} instead of {b}", channel.name());
        }
    }
}

/// A curved surface and a frame of random pixels, through both kinds of lenses.
fn frames() -> Vec<GBuffer<'static>> {
    let perspective = Projection::Perspective { fov_y: 1.0 };
    let parallel = Projection::Orthographic { height: 3.0 };
    let waves = [perspective, parallel].map(|projection| waves_through(projection, Size::px(150, 90)));
    let oblique = waves_through(perspective, Size::px(150, 90));
    let camera = oblique.camera().with_focal_px([120.0, 90.0]).unwrap().with_centre_px([40.0, 70.0]).unwrap();
    let oblique = GBuffer::new(camera, oblique.depth().to_vec(), oblique.normal().to_vec()).unwrap();
    waves.into_iter().chain([oblique, frame(Size::px(70, 33), 3), frame(Size::px(3, 2), 4)]).collect()
}

/// A network that corrects a search by nothing: its image is what the search found.
fn searching(search: SearchConfig) -> Model {
    let search = Some(search);
    let config = ModelConfig { search, encoder: vec![1], decoder: vec![], ..ModelConfig::correcting() };
    let graph = aonet::internals::graph::Graph::new(&config).unwrap();
    let mut tensors = Weights::init(&graph, 1).tensors().clone();
    tensors.values_mut().for_each(|tensor| tensor.values.fill(0.0));
    let weights = Weights::new(&graph, tensors).unwrap();
    Model::new(config, weights, TrainingFacts::default()).unwrap()
}

fn tuned() -> AgtaoParams {
    match SearchConfig::tuned() {
        SearchConfig::Agtao(tuned) => tuned,
        SearchConfig::Arcs(_) => unreachable!("agtao:tuned"),
    }
}

#[test]
fn searches_find_what_their_definition_says() {
    let tuned = tuned();
    let arcs = ArcsParams { power: 1.3, off: 0.2, ..ArcsParams::default() };
    let all = [
        SearchConfig::Agtao(tuned),
        SearchConfig::Agtao(AgtaoParams { denoise_passes: 0, ..tuned }),
        SearchConfig::Agtao(AgtaoParams { denoise_passes: 2, ..AgtaoParams::default() }),
        SearchConfig::Agtao(AgtaoParams {
            denoise_passes: 0,
            slices: 2,
            steps: 9,
            attenuation: 0.3,
            angle_bias: 0.0,
            ..tuned
        }),
        SearchConfig::Agtao(AgtaoParams { follow: 0.1, ..tuned }),
        SearchConfig::Agtao(AgtaoParams {
            follow: 1.0,
            denoise_passes: 0,
            steps: 9,
            radius_scale: 1.0,
            ..tuned
        }),
        SearchConfig::Arcs(arcs),
        SearchConfig::Arcs(ArcsParams { denoise_passes: 0, ..arcs }),
    ];
    for of in all {
        let model = searching(of);
        for gbuffer in frames() {
            let size = gbuffer.size();
            let expected = naive::search(&model, &gbuffer, params()).unwrap().values;
            for level in Level::available() {
                let options = Options { threads: 2, level, precision: Precision::F32 };
                let mut session = Session::with_options(&model, gbuffer.size(), options).unwrap();
                let mut found = AoImage::open(size);
                session.run(&gbuffer, params(), &mut found).unwrap();
                let off: Vec<f32> =
                    found.visibility().iter().zip(&expected).map(|(a, b)| (a - b).abs()).collect();
                let what = format!("{of:?}, {size:?}, {level:?}");
                if matches!(of, SearchConfig::Arcs(_)) {
                    let mean = off.iter().sum::<f32>() / off.len() as f32;
                    assert!(mean <= ARCS_TOLERANCE, "{what}: {mean:e} in the mean");
                    continue;
                }
                let flipped = off.iter().filter(|off| **off > SEARCH_TOLERANCE).count();
                let share = flipped as f32 / off.len() as f32;
                assert!(share <= FLIPPED_SHARE, "{what}: {flipped} pixels are off");
            }
        }
    }
}

/// Mean difference of the visibility that the bitmask finds: angles fall into one sector or the next. Measured: 4.5e-4 through an
/// oblique lens.
const VBAO_TOLERANCE: f32 = 8e-4;

#[test]
fn the_bitmask_of_one_layer_and_of_two_is_what_its_definition_says() {
    let bars = behind_bars(&waves(Size::px(150, 90)));
    assert!(bars.second().is_some());
    let Classic::Vbao(tuned) = Classic::named("vbao:tuned").unwrap() else { unreachable!() };
    let thin = VbaoParams { thickness: 0.1, denoise_passes: 0, ..tuned };
    for of in [VbaoParams::default(), tuned, thin, VbaoParams { cosine: 0, slices: 2, steps: 9, ..thin }] {
        for gbuffer in frames().into_iter().chain([bars.clone()]) {
            let expected = naive::vbao(&of, &gbuffer, params());
            for level in Level::available() {
                let options = search::Options { threads: 2, level };
                let mut session = search::Session::new(&Classic::Vbao(of), gbuffer.size(), options).unwrap();
                let mut found = AoImage::open(gbuffer.size());
                session.run(&gbuffer, params(), &mut found).unwrap();
                let off = found.visibility().iter().zip(&expected).map(|(a, b)| (a - b).abs()).sum::<f32>();
                let mean = off / expected.len() as f32;
                assert!(
                    mean <= VBAO_TOLERANCE,
                    "{of:?}, {:?}, {level:?}: {mean:e} in the mean",
                    gbuffer.size()
                );
            }
        }
    }
    // A layer less is noticed.
    let one = GBuffer::new(*bars.camera(), bars.depth().to_vec(), bars.normal().to_vec()).unwrap();
    let [a, b] = [&bars, &one].map(|gbuffer| naive::vbao(&thin, gbuffer, params()));
    let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len() as f32;
    assert!(off > 10.0 * VBAO_TOLERANCE, "{off:e}");
}

/// Largest angle of a bent normal where all taps fall on the same pixels and the pixel is not dark (degrees). Measured: one pixel of
/// 2310 with depths at random is farther off.
const BENT_TOLERANCE: f32 = 0.2;

/// The same share for bent normals of connected arcs, whose places are rounded to whole sectors. Measured with the default parameters: 0.009 with
/// depths at random, at most [`FLIPPED_SHARE`] on surfaces.
const FLIPPED_SECTORS: f32 = 0.02;

#[test]
fn bent_normals_are_what_their_definition_says() {
    let tuned = tuned();
    for search in [
        SearchConfig::Agtao(tuned),
        SearchConfig::Agtao(AgtaoParams { denoise_passes: 0, follow: 0.1, ..tuned }),
        SearchConfig::Agtao(AgtaoParams {
            denoise_passes: 0,
            slices: 2,
            power: 1.0,
            attenuation: 0.3,
            angle_bias: 0.0,
            ..tuned
        }),
        SearchConfig::Arcs(ArcsParams::default()),
        SearchConfig::Arcs(ArcsParams { denoise_passes: 0, slices: 2, power: 1.4, ..ArcsParams::default() }),
    ] {
        let model = searching(search);
        for gbuffer in frames() {
            let size = gbuffer.size();
            let expected = naive::bent_normals(&search, &gbuffer, params());
            for level in Level::available() {
                let options = Options { threads: 2, level, precision: Precision::F32 };
                let mut session = Session::with_bent_normals(&model, size, options).unwrap();
                let (mut image, mut found) = (AoImage::open(size), BentNormals::zeros(size));
                session.run_with_bent_normals(&gbuffer, params(), &mut image, &mut found).unwrap();
                let mut alone = AoImage::open(size);
                Session::with_options(&model, size, options)
                    .unwrap()
                    .run(&gbuffer, params(), &mut alone)
                    .unwrap();
                assert_eq!(image, alone, "bent normals change no visibility");
                let angles: Vec<f32> = found
                    .directions()
                    .iter()
                    .zip(expected.directions())
                    .map(|(a, b)| degrees(*a, *b))
                    .collect();
                let far = |i: &usize| angles[*i] > BENT_TOLERANCE && image.visibility()[*i] > 0.05;
                let flipped = (0..angles.len()).filter(far).count();
                let share = flipped as f32 / angles.len() as f32;
                let what = format!("{search:?}, {size:?}, {level:?}");
                let most =
                    if matches!(search, SearchConfig::Arcs(_)) { FLIPPED_SECTORS } else { FLIPPED_SHARE };
                assert!(share <= most, "{what}: {flipped} pixels are off");
            }
        }
    }
}

/// The angle between two vectors (degrees); 0 where both are 0.
fn degrees(a: [f32; 3], b: [f32; 3]) -> f32 {
    let (a, b) = (glam::Vec3::from(a), glam::Vec3::from(b));
    if a == b { 0.0 } else { a.angle_between(b).to_degrees() }
}

#[test]
fn networks_with_any_search_have_bent_normals_and_others_say_so() {
    let gbuffer = &frames()[0];
    let size = gbuffer.size();
    let (mut image, mut found) = (AoImage::open(size), BentNormals::zeros(size));
    let arcs = searching(SearchConfig::Arcs(ArcsParams::default()));
    let mut session = Session::with_bent_normals(&arcs, size, Options::default()).unwrap();
    session.run_with_bent_normals(gbuffer, params(), &mut image, &mut found).unwrap();
    let mut without = Session::new(&arcs, size, 1).unwrap();
    assert!(without.run_with_bent_normals(gbuffer, params(), &mut image, &mut found).is_err());
    let paper = model(ModelConfig::paper(), 1);
    let error = Session::with_bent_normals(&paper, size, Options::default()).unwrap_err().to_string();
    assert!(error.contains("without a search"), "{error}");
}

#[test]
fn another_parameter_is_noticed() {
    let tuned = tuned();
    let frames = frames();
    for (gbuffer, other) in [
        (&frames[0], AgtaoParams { attenuation: tuned.attenuation + 0.02, ..tuned }),
        (&frames[3], AgtaoParams { follow: 0.1, ..tuned }),
    ] {
        let values =
            |of| naive::search(&searching(SearchConfig::Agtao(of)), gbuffer, params()).unwrap().values;
        let (expected, found) = (values(tuned), values(other));
        let far = expected.iter().zip(&found).filter(|(a, b)| (**a - **b).abs() > SEARCH_TOLERANCE).count();
        assert!(far as f32 > FLIPPED_SHARE * expected.len() as f32, "{other:?}: {far} pixels");
    }
}

/// Mean difference of the shares that a survey finds: they have no filter, and a sector is 1/32 of a side's light.
/// Measured: 4.3e-4 on bars in front of waves, 1e-4 elsewhere.
const SURVEY_TOLERANCE: f32 = 1e-3;

#[test]
fn surveys_find_what_their_definition_says() {
    let arcs = ArcsParams { slices: 4, denoise_passes: 0, ..ArcsParams::default() };
    let bars = behind_bars(&waves(Size::px(70, 33)));
    for (patch, between) in [(1, 0), (2, 0), (2, 1), (4, 0), (4, 1), (8, 0)] {
        let arcs = ArcsParams { between, ..arcs };
        let model = model(ModelConfig { survey: Some(arcs), ..surveying(patch) }, 1);
        for gbuffer in frames().into_iter().chain([bars.clone()]) {
            let expected = naive::inputs(&model, &gbuffer, params()).survey.unwrap();
            let found = survey(&model, &arcs, &gbuffer, params());
            assert_eq!((found.channels, found.height, found.width), (6, expected.height, expected.width));
            let layers = f32::from(gbuffer.second().is_some());
            let plane = found.height * found.width;
            assert!(found.values[5 * plane..].iter().all(|value| *value == layers));
            let off = found.values.iter().zip(&expected.values).map(|(a, b)| (a - b).abs()).sum::<f32>();
            let mean = off / found.values.len() as f32;
            assert!(
                mean <= SURVEY_TOLERANCE,
                "patches of {patch}, {between} taps between, {:?}: {mean:e} in the mean",
                gbuffer.size()
            );
        }
    }
    // The cells of another place are noticed.
    let (a, b) = (surveying(2), surveying(4));
    let [a, b] = [a, b].map(|config| survey(&model(config, 1), &arcs, &bars, params()));
    let moved = Planes::from_fn((6, b.height, b.width), |c, y, x| a.at(c, 2 * y as isize, 2 * x as isize));
    let off = moved.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).sum::<f32>();
    assert!(off > 10.0 * SURVEY_TOLERANCE * b.values.len() as f32, "{off}");
}
