//! Tiny datasets for the tests of this crate.

use super::{Counts, DatasetParams, DatasetPlan, Manifest, Preset, Work, generate};
use aonet::Size;
use aonet_scene::scene::procedural::Kind;
use aonet_scene::staging::{SceneSpec, SceneSplit};
use std::path::Path;

/// Parameters of `frames` of `size` with `spp` rays each; the rest is the paper's.
pub(crate) fn params(size: Size, spp: u32, frames: Counts) -> DatasetParams {
    let (width, height) = (size.width(), size.height());
    DatasetParams { width, height, frames, spp, eval_spp: spp, ..DatasetParams::preset(Preset::Paper) }
}

/// Makes a dataset with one small scene for each of `splits`.
pub(crate) fn make(dir: &Path, params: DatasetParams, splits: &[SceneSplit]) -> Manifest {
    let scene = |(seed, split): (u64, &SceneSplit)| SceneSpec::procedural(Kind::ClutterPile, seed, *split);
    let plan = DatasetPlan::new(params, (1..).zip(splits).map(scene).collect()).unwrap();
    generate(dir, &plan, &Work::default(), &|_| ()).unwrap();
    Manifest::load(dir).unwrap()
}
