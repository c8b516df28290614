//! Everything that Tables 3 and 4 of the paper vary, and nothing else.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which channels the network sees. AO-Net §3.1 and Table 3; projected radius is ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// View-space normal: 3 channels. The paper's choice.
    Normal,
    /// Normal and depth in world units: 4 channels.
    NormalDepth,
    /// Normal and depth scaled to [0, 1] over the frame's foreground: 4 channels.
    NormalDepthNormalized,
    /// Normal and the AO radius in pixels, log2: 4 channels. One network for any radius and any unit.
    NormalProjectedRadius,
}

impl Features {
    /// Number of input channels.
    pub fn channels(self) -> usize {
        match self {
            Self::Normal => 3,
            Self::NormalDepth | Self::NormalDepthNormalized | Self::NormalProjectedRadius => 4,
        }
    }

    /// Whether the AO radius is an input, so that one network serves every radius.
    pub fn sees_radius(self) -> bool {
        match self {
            Self::NormalProjectedRadius => true,
            Self::Normal | Self::NormalDepth | Self::NormalDepthNormalized => false,
        }
    }
}

/// How the output is formed. AO-Net §3.3, Eq. 2 and Table 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KernelWeights {
    /// No kernels: the network's output is the visibility.
    Off,
    /// Plain weights over the 4x4 neighbourhood of the normals.
    Linear,
    /// Weights that are positive and sum to one over the neighbourhood. An ablation that must fail: a
    /// convex combination of normals cannot express visibility.
    Softmax,
}

/// The family of the topology.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arch {
    /// U-Net with two 3x3 convolutions a level, optional patches and kernels. AO-Net §3.2–3.3.
    AoNet,
}

/// What a network is, apart from its weights.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Topology.
    pub arch: Arch,
    /// Input channels.
    pub features: Features,
    /// Side of the square patches that become channels at the first level [px]: 1 (off), 2, 4 or 8.
    pub patch: usize,
    /// How the output is formed.
    pub kernel: KernelWeights,
    /// Channels of each encoder level, finest first; each level halves the resolution of the one before.
    pub encoder: Vec<usize>,
    /// Channels of each decoder level, coarsest first: one fewer than `encoder`.
    pub decoder: Vec<usize>,
}

/// Most levels and channels accepted from a file: keeps arithmetic on sizes far from overflow.
const MAX_LEVELS: usize = 8;
const MAX_WIDTH: usize = 1024;

impl ModelConfig {
    /// The paper's network: normals in, patches of 4, linear kernels. Widths are ours (the paper gives none).
    pub fn paper() -> Self {
        Self {
            arch: Arch::AoNet,
            features: Features::Normal,
            patch: 4,
            kernel: KernelWeights::Linear,
            encoder: vec![32, 48, 64, 96],
            decoder: vec![64, 48, 32],
        }
    }

    /// The paper's network with the projected radius as a fourth input channel.
    pub fn any_radius() -> Self {
        Self { features: Features::NormalProjectedRadius, ..Self::paper() }
    }

    /// The configuration after a check of every field.
    ///
    /// # Errors
    /// Names the field, what it accepts and what it holds.
    pub fn checked(self) -> Result<Self> {
        if !matches!(self.patch, 1 | 2 | 4 | 8) {
            return Err(Error::config("patch", "1, 2, 4 or 8", self.patch));
        }
        let levels = self.encoder.len();
        if !(1..=MAX_LEVELS).contains(&levels) {
            return Err(Error::config("encoder", format!("1 to {MAX_LEVELS} levels"), levels));
        }
        if self.decoder.len() + 1 != levels {
            let expected = format!("{} levels, one fewer than encoder", levels - 1);
            return Err(Error::config("decoder", expected, self.decoder.len()));
        }
        match self.encoder.iter().chain(&self.decoder).find(|w| !(1..=MAX_WIDTH).contains(*w)) {
            Some(width) => Err(Error::config("widths", format!("1 to {MAX_WIDTH} channels"), width)),
            None => Ok(self),
        }
    }
}
