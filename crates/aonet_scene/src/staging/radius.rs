//! The choice of a view's AO radius.

use serde::{Deserialize, Serialize};

/// Rule for the AO radius of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiusRule {
    /// This fraction of the bounding sphere's radius, without the ground: the same in all frames of a scene.
    SceneFraction(f32),
    /// Log-uniform per frame, so that at the view's median depth the radius projects to between `min` and
    /// `max` of the image's height. Users think of a radius as a length on the screen, and the bounding
    /// spheres of a city and a room are not comparable.
    ImageFraction {
        /// Smallest projection, in image heights.
        min: f32,
        /// Largest projection, in image heights.
        max: f32,
    },
    /// This length (world units) in every frame.
    Given(f32),
}

impl RadiusRule {
    /// From contact shadows to a room: 2 % to 40 % of the image's height.
    pub const ANY: Self = Self::ImageFraction { min: 0.02, max: 0.4 };
}
