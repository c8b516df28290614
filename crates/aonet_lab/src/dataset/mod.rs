//! Datasets: many views of many scenes with their reference AO, and the manifest that lists them.
//!
//! A [`DatasetPlan`] lists the frames to make; [`generate`] makes them; a [`Manifest`] lists the frames that
//! exist. Splits are by scene: no scene is both trained on and tested with. Frame `i` of a scene depends on
//! the seed, the scene's name and `i` alone, never on order, shard or other scenes.

pub mod catalog;
mod generate;
mod import;
mod imported;
mod manifest;
mod merge;
mod mix;
mod plan;
mod sheet;
mod split;

pub use generate::{Event, Summary, Work, generate, remake};
pub use import::{Import, ImportSummary, Unmatched, import};
pub use imported::{ImportRule, ImportedFrom, NormalCoding};
pub use manifest::{FORMAT, FrameEntry, Manifest};
pub use merge::merge;
pub use mix::Stock;
pub use plan::{Counts, DatasetParams, DatasetPlan, Job, Preset, Shard};
pub use sheet::contact_sheet;
pub use split::Split;

#[cfg(test)]
use aonet_scene::{Scene, scene::glb};
#[cfg(test)]
#[path = "../../../aonet_scene/src/staging/fixtures.rs"]
mod fixtures;
#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) mod tiny;
