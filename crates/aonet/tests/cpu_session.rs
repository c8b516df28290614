//! The CPU runtime against the oracle: whole networks.

mod common;

use aonet::AoImage;
use aonet::net::cpu::{Level, Session};
use aonet::net::{ModelConfig, naive};
use common::{assert_close, frame, model, params};

/// Measured: 3e-7 at most, from the order of summation.
const TOLERANCE: f32 = 2e-6;

#[test]
fn the_papers_network_at_every_level() {
    let model = model(ModelConfig::paper(), 1);
    for size in [(100, 70), (64, 32)] {
        let gbuffer = frame(size, 2);
        let expected = naive::run(&model, &gbuffer, params()).unwrap();
        for level in Level::available() {
            let mut session = Session::with_level(&model, size, 2, level).unwrap();
            let mut image = AoImage::open(size.0, size.1).unwrap();
            session.run(&gbuffer, params(), &mut image).unwrap();
            assert_close(&image, &expected, (TOLERANCE, &format!("{size:?} {level:?}")));
        }
    }
}
