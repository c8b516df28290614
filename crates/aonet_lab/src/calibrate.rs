//! Ranges of the values that a network's convolutions read on the frames of a dataset; integers have to cover them.

use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval::read;
use aonet::AoImage;
use aonet::net::cpu::Session;
use aonet::net::{Model, Ranges};
use aonet_scene::Result;
use aonet_scene::error::Error;

/// Ranges of `model` on `count` training frames of the dataset, evenly spread, and on the same frames without guard band and second
/// layer. `progress` is called once a frame with the
/// number of frames done and of all.
///
/// # Errors
/// When a frame is broken, or there are no training frames.
pub fn ranges(
    model: &Model,
    manifest: &Manifest,
    (count, threads): (usize, usize),
    progress: &dyn Fn(usize, usize),
) -> Result<Ranges> {
    let train: Vec<&FrameEntry> = manifest.frames(Split::Train).collect();
    let count = count.min(train.len());
    if count == 0 {
        return Err(Error::file(manifest.dir(), "training frames to calibrate with", "none"));
    }
    let mut ranges = Ranges::new();
    for k in 0..count {
        let (frame, params, _) = read(manifest, train[k * train.len() / count])?;
        let without_second = frame.clone().without_second();
        let bare = without_second.without_margin();
        for gbuffer in [Some(&frame), (bare != frame).then_some(&bare)].into_iter().flatten() {
            let mut image = AoImage::open(gbuffer.window().size());
            let mut session = Session::new(model, gbuffer.window(), threads)?;
            session.calibrate(gbuffer, params, &mut image, &mut ranges)?;
        }
        progress(k + 1, count);
    }
    Ok(ranges)
}
