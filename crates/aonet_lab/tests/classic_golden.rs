//! Classic methods on the demo's room against pictures that were inspected by eye.
//!
//! `AONET_UPDATE=1` writes the pictures again; inspect them before committing.

use aonet::search::Classic;
use aonet::{AoImage, metrics};
use aonet_lab::ao_file;
use aonet_scene::gbuffer;
use aonet_scene::scene::procedural;
use aonet_scene::trace::Tracer;
use std::path::{Path, PathBuf};

/// Instruction sets round differently, and a horizon may fall on the other side of a pixel (dB).
const LEAST: f64 = 45.0;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"))
}

fn psnr(a: &AoImage, b: &AoImage) -> f64 {
    metrics::compare(a, b, None).expect("images of one size").full.psnr
}

#[test]
fn methods_draw_what_was_looked_at() {
    let (scene, mut view) = procedural::demo();
    (view.width, view.height) = (320, 180);
    let surface = gbuffer::render(&Tracer::new(scene), &view).unwrap();
    let update = std::env::var_os("AONET_UPDATE").is_some();
    let mut found = Vec::new();
    for method in Classic::all() {
        let image = method.run(&surface.gbuffer, view.params().unwrap()).unwrap();
        let path = golden(method.name());
        if update {
            ao_file::save_ao(&path, &image).unwrap();
        }
        let expected = ao_file::load_ao(&path).unwrap();
        let score = psnr(&expected, &image);
        assert!(score > LEAST, "{}: {score} dB", method.name());
        found.push(image);
    }
    // The bound tells every method from every other one.
    for (i, a) in found.iter().enumerate() {
        for b in &found[..i] {
            assert!(psnr(a, b) < LEAST - 10.0);
        }
    }
}
