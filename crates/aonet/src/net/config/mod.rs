//! What a network is, apart from its weights: everything that Tables 3 and 4 of the paper vary, and our search.

mod features;
mod file;
mod search;

use crate::error::{Error, Result};
use crate::net::kernel::TAPS;
use crate::net::neighbours::{MAX_DISTANCE, MAX_DISTANCES};
use crate::search::ArcsParams;
use serde::{Deserialize, Serialize};

pub use features::{Axis, Channel, Features};
pub use search::SearchConfig;

/// Whether the head predicts kernels over the normals. AO-Net §3.3, Eq. 2 and Table 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KernelWeights {
    /// No kernels: the head's convolution itself is the network's output.
    Off,
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
            Self::Off => 1,
            Self::Linear | Self::Softmax => TAPS,
        }
    }
}

/// How the image follows from the network's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// The output is the visibility.
    #[default]
    Visibility,
    /// The output is added to the visibility that the search finds. Needs [`ModelConfig::search`].
    Correction,
    /// The same, and weights of the shares of light that the search reports: how much of what is hidden, or off the frame, is open
    /// after all. Needs a search that reports shares, and no kernels.
    Shares,
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "file::ConfigFile")]
pub struct ModelConfig {
    /// Topology.
    pub arch: Arch,
    /// Input channels.
    pub features: Features,
    /// Side of the square patches that become channels at the first level (px): 1 (off), 2, 4 or 8.
    pub patch: usize,
    /// Whether the head predicts kernels.
    pub kernel: KernelWeights,
    /// How the image follows from the network's output.
    pub output: Output,
    /// The search that runs before the network, for the channels that show one, [`Output::Correction`] and [`Output::Shares`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchConfig>,
    /// Connected arcs from one pixel of every patch, whose shares of light the first convolution sees beside the features: a search at
    /// the network's own resolution, and so a cheap one. [`Arch::AoNet`] only, and without a filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub survey: Option<ArcsParams>,
    /// Channels of a 1x1 convolution between what the network reads and the first level: an embedding of each patch, as of Dosovitskiy et al.
    /// 2021. With wide patches it takes fewer multiplications than a 3x3 convolution of all their pixels. [`Arch::AoNet`] only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub embedding: Option<usize>,
    /// Channels of each encoder level, finest first; each level halves the resolution of the one before.
    pub encoder: Vec<usize>,
    /// Channels of each decoder level, coarsest first: one fewer than `encoder`.
    pub decoder: Vec<usize>,
    /// Skip connections.
    pub skips: Skips,
    /// Distances at which the network weighs neighbours (px), increasing: at each, eight pixels on a square around a pixel. It adds the weighted
    /// differences between what the search found there and at the pixel: a filter that the network steers. Kernel prediction, as of
    /// Bako et al. 2017. Needs [`Output::Correction`] or [`Output::Shares`], and no [`kernel`](Self::kernel).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub neighbours: Vec<usize>,
    /// Whether the filter of the search also runs over the image. With [`Output::Correction`] it smooths what the network adds, because
    /// pixels of one patch get similar corrections on both sides of a silhouette, and settles what the search found. With [`Output::Shares`]
    /// it settles the image. To settle is to remove differences from the neighbours' mean that are small, up to 0.02: they are noise of the
    /// search. Needs a search with a filter.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub smooth: bool,
}

/// Most levels and channels accepted from a file: keeps arithmetic on sizes far from overflow.
const MAX_LEVELS: usize = 8;
const MAX_WIDTH: usize = 1024;

impl ModelConfig {
    /// The paper's network: normals in, patches of 4, linear kernels. Widths are ours (the paper gives none).
    pub fn paper() -> Self {
        Self {
            arch: Arch::AoNet,
            features: Features::normal(),
            patch: 4,
            kernel: KernelWeights::Linear,
            output: Output::Visibility,
            search: None,
            survey: None,
            embedding: None,
            encoder: vec![32, 48, 64, 96],
            decoder: vec![64, 48, 32],
            skips: Skips::Concat,
            neighbours: vec![],
            smooth: false,
        }
    }

    /// Deep Shading's network for AO. Nalbach et al. 2017.
    pub fn deep_shading() -> Self {
        Self {
            arch: Arch::DeepShading,
            features: Features::normal_position(),
            patch: 1,
            kernel: KernelWeights::Off,
            output: Output::Visibility,
            search: None,
            survey: None,
            embedding: None,
            encoder: vec![8, 16, 32, 64, 128, 256],
            decoder: vec![128, 64, 32, 16, 1],
            skips: Skips::Concat,
            neighbours: vec![],
            smooth: false,
        }
    }

    /// DeepAO's network. Zhang et al. 2020.
    pub fn deep_ao() -> Self {
        Self {
            arch: Arch::DeepAo,
            features: Features::normal_depth(),
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
    pub fn correcting() -> Self {
        Self {
            features: Features::normal_radius_horizon(),
            kernel: KernelWeights::Off,
            output: Output::Correction,
            search: Some(SearchConfig::tuned()),
            encoder: vec![32, 48, 64, 64, 48],
            decoder: vec![48, 56, 48, 32],
            ..Self::paper()
        }
    }

    /// The same with a survey and weights of neighbours, as the shipped network `balanced` has them.
    pub fn balanced() -> Self {
        // What `high` was trained with, but more taps in fewer slices: neighbours make up for slices, nothing for surfaces between taps.
        let survey = ArcsParams {
            slices: 2,
            steps: 16,
            distribution: 1.592,
            angle_bias: 1.2033,
            denoise_passes: 0,
            ..ArcsParams::default()
        };
        Self { survey: Some(survey), neighbours: vec![1, 3], smooth: true, ..Self::correcting() }
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
        let mut widths = self.embedding.iter().chain(&self.encoder).chain(&self.decoder);
        if let Some(width) = widths.find(|w| !(1..=MAX_WIDTH).contains(*w)) {
            return Err(Error::config("widths", format!("1 to {MAX_WIDTH} channels"), width));
        }
        self.check_features()?;
        self.check_search()?;
        self.check_survey()?;
        self.check_neighbours()?;
        self.check_smooth()?;
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

    fn check_features(&self) -> Result<()> {
        let features = &self.features;
        let error = |expected: &str, found: Channel| Err(Error::config("features", expected, found.name()));
        if let Some(channel) = features.repeated() {
            return error("every channel once", channel);
        }
        if let Some(channel) = features.torn_vector() {
            return error("x, y and z of a vector side by side", channel);
        }
        if !features.begin_with_a_normal() {
            let first = features.channels().first().map_or("none", |channel| channel.name());
            return Err(Error::config("features", "a normal first, plain or encoded", first));
        }
        Ok(())
    }

    fn check_survey(&self) -> Result<()> {
        match self.survey.map(|survey| SearchConfig::Arcs(survey).checked().map(|_| survey.denoise_passes)) {
            None | Some(Ok(0)) => Ok(()),
            Some(Ok(passes)) => Err(Error::config("survey", "denoise_passes 0: it has no filter", passes)),
            Some(Err(error)) => Err(error),
        }
    }

    fn check_neighbours(&self) -> Result<()> {
        let distances = &self.neighbours;
        if distances.is_empty() {
            return Ok(());
        }
        let increasing =
            distances.is_sorted_by(|a, b| a < b) && distances.iter().all(|d| (1..=MAX_DISTANCE).contains(d));
        if !increasing || distances.len() > MAX_DISTANCES {
            let expected = format!("at most {MAX_DISTANCES} increasing distances of 1 to {MAX_DISTANCE} px");
            return Err(Error::config("neighbours", expected, format!("{distances:?}")));
        }
        if self.output == Output::Visibility || self.kernel != KernelWeights::Off {
            let found = format!("{:?} and {:?}", self.output, self.kernel);
            return Err(Error::config("neighbours", "output correction or shares, and kernel off", found));
        }
        Ok(())
    }

    fn check_smooth(&self) -> Result<()> {
        let passes = self.search.map_or(0, |search| search.filter().passes);
        match (self.smooth, self.output) {
            (false, _) => Ok(()),
            (true, Output::Correction | Output::Shares) if passes > 0 => Ok(()),
            (true, output) => {
                let expected = "output correction or shares, and a search with denoise_passes above 0";
                Err(Error::config("smooth", expected, format!("{output:?} and {passes} passes")))
            }
        }
    }

    fn check_search(&self) -> Result<()> {
        let is_read = self.features.show_a_search() || self.output != Output::Visibility;
        let planes = self.search.map_or(0, |search| search.planes());
        let absent = |channel: &&Channel| channel.search_plane().is_some_and(|plane| plane >= planes.max(1));
        if let Some(channel) = self.features.channels().iter().find(absent) {
            return Err(Error::config(
                "search",
                format!("arcs, which reports {}", channel.name()),
                "another one",
            ));
        }
        if self.output == Output::Shares && (planes < 2 || self.kernel != KernelWeights::Off) {
            let found =
                format!("{:?} and {}", self.kernel, self.search.map_or("none", |s| s.method().name()));
            return Err(Error::config("output", "kernel off and the search arcs, to weigh shares", found));
        }
        match self.search {
            Some(search) if is_read => search.checked().map(drop),
            Some(search) => {
                let expected = "none, since neither a channel nor the output reads it";
                Err(Error::config("search", expected, search.method().name()))
            }
            None if is_read => {
                Err(Error::config("search", "a search for the horizon occlusion or the correction", "none"))
            }
            None => Ok(()),
        }
    }
}
