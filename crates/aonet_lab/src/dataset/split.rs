//! What the frames of a dataset are for.

use aonet_scene::staging::SceneSplit;
use serde::{Deserialize, Serialize};

/// What a frame is for.
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

    /// Whether frames of such scenes may be in it.
    pub fn takes(self, scenes: SceneSplit) -> bool {
        match self {
            Self::Train | Self::ValSeen => scenes == SceneSplit::Train,
            Self::Val => scenes == SceneSplit::Val,
            Self::Test => scenes == SceneSplit::Test,
        }
    }

    /// The split of frames of such scenes, unless said otherwise.
    pub fn of(scenes: SceneSplit) -> Self {
        match scenes {
            SceneSplit::Train => Self::Train,
            SceneSplit::Val => Self::Val,
            SceneSplit::Test => Self::Test,
        }
    }
}
