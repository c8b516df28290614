//! How the AO radius of a view is chosen.

use serde::{Deserialize, Serialize};

/// How the AO radius of a frame is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiusRule {
    /// This fraction of the bounding sphere's radius, without the ground: the same in all frames of a scene.
    SceneFraction(f32),
    /// Log-uniform per frame, so that at the view's median depth the radius projects to between `min` and
    /// `max` of the image's height. What a user calls a sensible radius is a length on the screen: bounding
    /// spheres do not compare between a city and a room.
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
