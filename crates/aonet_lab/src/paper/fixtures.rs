//! A tiny dataset, tiny networks and made-up measurements for the tests.

use super::measure::{Measured, Measurements};
use crate::dataset::{Counts, Manifest, tiny};
use crate::eval::Row;
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{Model, ModelConfig, TrainingFacts, WeightFormat};
use aonet::{Camera, GBuffer, Projection, Size};
use aonet_scene::staging::SceneSplit;
use std::path::Path;

/// Four test frames of two scenes, 96x64, and no others.
pub(crate) fn dataset(dir: &Path) -> Manifest {
    let frames = Counts { train: 0, val: 0, val_seen: 0, test: 4 };
    tiny::make(dir, tiny::params(Size::px(96, 64), 8, frames), &[SceneSplit::Test; 2])
}

/// A network with the patches, kernels and features of `config` and the smallest widths, random weights.
pub(crate) fn save_model(dir: &Path, name: &str, config: ModelConfig) {
    let config = ModelConfig { encoder: vec![4, 4], decoder: vec![4], ..config };
    let seed = name.bytes().map(u64::from).sum();
    let weights = Weights::init(&Graph::new(&config).unwrap(), seed);
    let facts = TrainingFacts {
        radius: "SceneFraction(0.1)".into(),
        mean_visibility: Some(0.75),
        steps: 12,
        ..TrainingFacts::default()
    };
    let bytes = Model::new(config, weights, facts).unwrap().to_bytes(WeightFormat::F16).unwrap();
    std::fs::write(dir.join(format!("{name}.safetensors")), bytes).unwrap();
}

/// Two pixels at distance 1 and one of sky.
pub(crate) fn two_pixels_and_sky() -> GBuffer<'static> {
    let projection = Projection::Perspective { fov_y: 1.0 };
    let camera = Camera::new(projection, Size::px(3, 1)).unwrap().with_near(0.1).unwrap();
    GBuffer::new(camera, vec![1.0, 1.0, f32::INFINITY], vec![[0.0, 0.0, 1.0]; 3]).unwrap()
}

/// Means of which the tests use only two.
pub(crate) fn scores(ssim: f64, psnr: f64) -> Row {
    Row {
        frames: 1,
        ssim,
        ssim_8x8: 0.0,
        psnr,
        psnr_pooled: 0.0,
        ssim_foreground: None,
        ssim_8x8_foreground: None,
        psnr_foreground: None,
        psnr_pooled_foreground: None,
        ms: None,
    }
}

/// Measurements of rows: name, SSIM, PSNR (dB), time at 1280x720 (ms).
pub(crate) fn measurements(rows: &[(&str, f64, f64, f64)]) -> Measurements {
    let row = |&(key, ssim, psnr, ms): &(&str, f64, f64, f64)| {
        let measured = Measured {
            scores: vec![scores(ssim, psnr)],
            ms: [("1280x720".to_owned(), ms)].into(),
            f16_bytes: Some(1_000_000),
            radius_fits: true,
            ..Measured::default()
        };
        (key.to_owned(), measured)
    };
    Measurements { rows: rows.iter().map(row).collect(), constant: None }
}
