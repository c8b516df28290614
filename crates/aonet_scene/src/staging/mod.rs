//! Finds places for a camera in a scene, and views that are good enough for a dataset.

mod judge;
mod propose;
mod radius;
mod spec;
mod stage;

pub use judge::Flaw;
pub use propose::propose_view;
pub use radius::RadiusRule;
pub use spec::{Candidate, SceneSpec, SceneSplit, is_name_char};
pub use stage::{Framing, Stage};

#[cfg(test)]
use crate::{Scene, scene::glb};
#[cfg(test)]
mod fixtures;
