//! The splits of a dataset.

use aonet_scene::staging::SceneSplit;
use serde::{Deserialize, Serialize};

/// The purpose of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// Training.
    Train,
    /// Validation on scenes that no training frame shows.
    Val,
    /// Validation on the training scenes, as in the paper.
    ValSeen,
    /// Test, on scenes that neither training nor validation shows.
    Test,
}

impl Split {
    /// The name in manifests and commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::ValSeen => "val_seen",
            Self::Test => "test",
        }
    }

    /// Whether frames of scenes of this split may be in it.
    pub fn takes(self, scenes: SceneSplit) -> bool {
        match self {
            Self::Train | Self::ValSeen => scenes == SceneSplit::Train,
            Self::Val => scenes == SceneSplit::Val,
            Self::Test => scenes == SceneSplit::Test,
        }
    }

    /// The default split of frames of these scenes.
    pub fn of(scenes: SceneSplit) -> Self {
        match scenes {
            SceneSplit::Train => Self::Train,
            SceneSplit::Val => Self::Val,
            SceneSplit::Test => Self::Test,
        }
    }
}
