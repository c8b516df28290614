//! Everything that Tables 3 and 4 of the paper vary, and nothing else.

use crate::error::{Error, Result};
use crate::net::graph::TAPS;
use serde::{Deserialize, Serialize};

/// Which channels the network sees. AO-Net §3.1 and Table 3; projected radius is ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// View-space normal: 3 channels. The paper's choice.
    Normal,
    /// The same as n/2 + 1/2, as G-buffers store it: 3 channels.
    NormalEncoded,
    /// Normal and depth in world units: 4 channels.
    NormalDepth,
    /// Normal and depth scaled to [0, 1] over the frame's foreground: 4 channels.
    NormalDepthNormalized,
    /// Normal and the AO radius in pixels, log2: 4 channels. One network for any radius and any unit.
    NormalProjectedRadius,
    /// The same and what a horizon search finds: 5 channels.
    NormalRadiusHorizon,
    /// Normal and view-space position in world units: 6 channels. What Deep Shading sees.
    NormalPosition,
}

/// What one input channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Component 0, 1 or 2 of the view-space normal; 0 on the background.
    Normal(u8),
    /// The same as n/2 + 1/2; 0 on the background.
    NormalEncoded(u8),
    /// Component 0, 1 or 2 of the view-space position (world units); 0 on the background.
    Position(u8),
    /// Depth along -Z (world units); 0 on the background.
    Depth,
    /// Depth scaled to [0, 1] over the foreground of the frame; 1 on the background.
    DepthNormalized,
    /// (log2(AO radius in pixels) - 5) / 4; the background is infinitely far.
    ProjectedRadius,
    /// 1 minus the visibility that `agtao:tuned` finds ([`AgtaoParams`](crate::search::AgtaoParams), 36 taps a pixel); 0 on the
    /// background.
    HorizonOcclusion,
}

impl Channel {
    /// Its name in tables and plots.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal(k) => ["normal x", "normal y", "normal z"][usize::from(k)],
            Self::NormalEncoded(k) => {
                ["encoded normal x", "encoded normal y", "encoded normal z"][usize::from(k)]
            }
            Self::Position(k) => ["position x", "position y", "position z"][usize::from(k)],
            Self::Depth => "depth",
            Self::DepthNormalized => "normalised depth",
            Self::ProjectedRadius => "projected radius",
            Self::HorizonOcclusion => "horizon occlusion",
        }
    }
}

const NORMAL: [Channel; 3] = [Channel::Normal(0), Channel::Normal(1), Channel::Normal(2)];

impl Features {
    /// The input channels; the first three are the normal.
    pub fn channels(self) -> &'static [Channel] {
        const fn and(fourth: Channel) -> [Channel; 4] {
            [NORMAL[0], NORMAL[1], NORMAL[2], fourth]
        }
        match self {
            Self::Normal => &NORMAL,
            Self::NormalEncoded => {
                use Channel::NormalEncoded;
                const { &[NormalEncoded(0), NormalEncoded(1), NormalEncoded(2)] }
            }
            Self::NormalDepth => const { &and(Channel::Depth) },
            Self::NormalDepthNormalized => const { &and(Channel::DepthNormalized) },
            Self::NormalProjectedRadius => const { &and(Channel::ProjectedRadius) },
            Self::NormalRadiusHorizon => {
                const { &[NORMAL[0], NORMAL[1], NORMAL[2], Channel::ProjectedRadius, Channel::HorizonOcclusion] }
            }
            Self::NormalPosition => {
                use Channel::Position;
                const { &[NORMAL[0], NORMAL[1], NORMAL[2], Position(0), Position(1), Position(2)] }
            }
        }
    }

    /// The channel with the horizon search's result, if there is one.
    pub fn horizon(self) -> Option<usize> {
        self.channels().iter().position(|c| *c == Channel::HorizonOcclusion)
    }

    /// Whether the AO radius is an input, so that one network serves every radius.
    pub fn sees_radius(self) -> bool {
        self.channels().contains(&Channel::ProjectedRadius)
    }
}

/// How the output is formed. AO-Net §3.3, Eq. 2 and Table 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KernelWeights {
    /// No kernels: the network's output is the visibility.
    Off,
    /// No kernels: the network's output is what the visibility of the horizon search lacks. Needs
    /// [`Channel::HorizonOcclusion`].
    Correction,
    /// Plain weights over the 4x4 neighbourhood of the normals.
    Linear,
    /// Weights that are positive and sum to one over the neighbourhood. An ablation that must fail: a
    /// convex combination of normals cannot express visibility.
    Softmax,
}

impl KernelWeights {
    /// Outputs of the head for each pixel.
    pub fn outputs_per_pixel(self) -> usize {
        match self {
            Self::Off | Self::Correction => 1,
            Self::Linear | Self::Softmax => TAPS,
        }
    }
}

/// The family of the topology.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arch {
    /// U-Net with two 3x3 convolutions a level, optional patches and kernels. AO-Net §3.2–3.3.
    AoNet,
    /// U-Net of grouped convolutions, one a level. Nalbach et al. 2017, the network for AO.
    DeepShading,
    /// U-Net that sees the input again at every level. Zhang et al. 2020.
    DeepAo,
}

/// What a decoder level sees of the encoder level of its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Skips {
    /// Its channels, after the upsampled ones.
    #[default]
    Concat,
    /// Nothing: an ablation.
    None,
}

/// What a network is, apart from its weights.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Topology.
    pub arch: Arch,
    /// Input channels.
    pub features: Features,
    /// Side of the square patches that become channels at the first level (px): 1 (off), 2, 4 or 8.
    pub patch: usize,
    /// How the output is formed.
    pub kernel: KernelWeights,
    /// Channels of each encoder level, finest first; each level halves the resolution of the one before.
    pub encoder: Vec<usize>,
    /// Channels of each decoder level, coarsest first: one fewer than `encoder`.
    pub decoder: Vec<usize>,
    /// Skip connections.
    #[serde(default)]
    pub skips: Skips,
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
            skips: Skips::Concat,
        }
    }

    /// Deep Shading's network for AO. Nalbach et al. 2017.
    pub fn deep_shading() -> Self {
        Self {
            arch: Arch::DeepShading,
            features: Features::NormalPosition,
            patch: 1,
            kernel: KernelWeights::Off,
            encoder: vec![8, 16, 32, 64, 128, 256],
            decoder: vec![128, 64, 32, 16, 1],
            skips: Skips::Concat,
        }
    }

    /// DeepAO's network. Zhang et al. 2020.
    pub fn deep_ao() -> Self {
        Self {
            arch: Arch::DeepAo,
            features: Features::NormalDepth,
            encoder: vec![4, 8, 16, 32, 32],
            decoder: vec![16, 8, 4, 4],
            ..Self::deep_shading()
        }
    }

    /// The paper's U-Net before patches: one more level, at full resolution. AO-Net §3.2: patches go "directly to the
    /// second layer". Half the width of that layer, as the paper's levels go.
    pub fn full_resolution() -> Self {
        Self { patch: 1, encoder: vec![16, 32, 48, 64, 96], decoder: vec![64, 48, 32, 16], ..Self::paper() }
    }

    /// Ours: corrects a horizon search, knows the radius, has one more level and no kernels; fewer
    /// multiplications than the paper's.
    pub fn any_radius() -> Self {
        Self {
            features: Features::NormalRadiusHorizon,
            kernel: KernelWeights::Correction,
            encoder: vec![32, 48, 64, 64, 48],
            decoder: vec![48, 56, 48, 32],
            ..Self::paper()
        }
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
        if let Some(width) = self.encoder.iter().chain(&self.decoder).find(|w| !(1..=MAX_WIDTH).contains(*w))
        {
            return Err(Error::config("widths", format!("1 to {MAX_WIDTH} channels"), width));
        }
        if self.kernel == KernelWeights::Correction && self.features.horizon().is_none() {
            let expected = "features with the horizon occlusion, which a correction corrects";
            return Err(Error::config("features", expected, format!("{:?}", self.features)));
        }
        let published = match self.arch {
            Arch::AoNet => return Ok(self),
            Arch::DeepShading => Self::deep_shading(),
            Arch::DeepAo => Self::deep_ao(),
        };
        match self == published {
            true => Ok(self),
            false => {
                let expected = format!("the published network, {published:?}");
                Err(Error::config("arch", expected, format!("{self:?}")))
            }
        }
    }
}
