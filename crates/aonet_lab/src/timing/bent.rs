//! What bent normals cost beside visibility.

use super::{RADIUS, bump, median, ms_since, of_search};
use aonet::net::{Model, cpu};
use aonet::search::{self, Classic};
use aonet::{AoImage, AoParams, BentNormals, Size};
use aonet_scene::Result;
use serde::Serialize;
use std::time::Instant;

/// Median times of runs without and with bent normals, which take turns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BentTimes {
    /// Visibility alone (ms).
    pub without_ms: f64,
    /// Visibility and bent normals (ms).
    pub with_ms: f64,
    /// Median of the ratios of neighbouring runs.
    pub ratio: f64,
}

/// Times a network on a synthetic frame.
///
/// # Errors
/// When it has no search, or the threads cannot be started.
pub fn time_bent_normals(model: &Model, size: Size, options: cpu::Options, runs: usize) -> Result<BentTimes> {
    let (gbuffer, params) = (bump(size)?, AoParams::new(RADIUS)?);
    let (mut image, mut bent) = (AoImage::open(size), BentNormals::zeros(size));
    let mut plain = cpu::Session::with_options(model, size, options)?;
    let mut both = cpu::Session::with_bent_normals(model, size, options)?;
    alternating(runs, |wants_bent| match wants_bent {
        false => plain.run(&gbuffer, params, &mut image),
        true => both.run_with_bent_normals(&gbuffer, params, &mut image, &mut bent),
    })
}

/// The same for a classic method.
///
/// # Errors
/// When it has no bent normals, the threads cannot be started, or the machine does not have the instructions.
pub fn time_classic_bent_normals(
    method: &Classic,
    size: Size,
    options: cpu::Options,
    runs: usize,
) -> Result<BentTimes> {
    let (gbuffer, params) = (bump(size)?, AoParams::new(RADIUS)?);
    let (mut image, mut bent) = (AoImage::open(size), BentNormals::zeros(size));
    let options = of_search(options);
    let mut plain = search::Session::new(method, size, options)?;
    let mut both = search::Session::with_bent_normals(method, size, options)?;
    alternating(runs, |wants_bent| match wants_bent {
        false => plain.run(&gbuffer, params, &mut image),
        true => both.run_with_bent_normals(&gbuffer, params, &mut image, &mut bent),
    })
}

/// Times runs without and with bent normals that take turns, after a first one of each.
fn alternating(runs: usize, mut run: impl FnMut(bool) -> aonet::Result<()>) -> Result<BentTimes> {
    run(false)?;
    run(true)?;
    let (mut without, mut with, mut ratios) = (vec![], vec![], vec![]);
    for _ in 0..runs.max(1) {
        let mut timed = |wants_bent| -> Result<f64> {
            let start = Instant::now();
            run(wants_bent)?;
            Ok(ms_since(start))
        };
        let [a, b] = [timed(false)?, timed(true)?];
        without.push(a);
        with.push(b);
        ratios.push(b / a);
    }
    Ok(BentTimes { without_ms: median(&mut without), with_ms: median(&mut with), ratio: median(&mut ratios) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::net::shipped;

    #[test]
    fn methods_with_bent_normals_are_timed_and_others_refused() {
        let size = Size::px(64, 40);
        let agtao = Classic::named("agtao").unwrap();
        let times = time_classic_bent_normals(&agtao, size, cpu::Options::default(), 3).unwrap();
        assert!(times.without_ms > 0.0 && times.with_ms > 0.0 && times.ratio > 0.0, "{times:?}");
        assert!(
            time_classic_bent_normals(&Classic::named("ssao").unwrap(), size, cpu::Options::default(), 1)
                .is_err()
        );
        let [fast, paper] = [shipped::FAST, shipped::PAPER].map(|bytes| Model::from_bytes(bytes).unwrap());
        assert!(time_bent_normals(&fast, size, cpu::Options::default(), 1).unwrap().ratio > 0.0);
        assert!(time_bent_normals(&paper, size, cpu::Options::default(), 1).is_err());
    }
}
