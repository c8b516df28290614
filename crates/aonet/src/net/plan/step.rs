//! The steps of a plan.

use super::buffer::BufferId;
use crate::net::config::{KernelWeights, SearchConfig};
use crate::net::graph::Activation;
#[cfg(doc)]
use crate::net::graph::Op;
use crate::net::neighbours;
use crate::search::{ArcsParams, Pass};

/// How a convolution reads a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resample {
    /// As it is.
    None,
    /// [`Op::AvgPool2`] one or more times: the mean of squares of this side (px).
    AvgPool(usize),
    /// [`Op::Upsample2`].
    Upsample2,
}

/// One of the inputs of a convolution; their channels follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// The buffer that is read.
    pub buffer: BufferId,
    /// How it is read.
    pub resample: Resample,
}

/// A convolution of a plan. See [`Op::Conv`].
#[derive(Debug, Clone, PartialEq)]
pub struct ConvStep {
    /// Prefix of the parameter names.
    pub name: String,
    /// One or more.
    pub sources: Vec<Source>,
    /// Blocked.
    pub output: BufferId,
    /// Side of the filter: 1 or 3.
    pub size: usize,
    /// Groups of channels.
    pub groups: usize,
    /// What follows.
    pub activation: Activation,
}

/// The last step of a network that predicts kernels, or merges patches.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadStep {
    /// Prefix of the parameter names.
    pub name: String,
    /// Blocked.
    pub input: BufferId,
    /// The partitioned features.
    pub guide: BufferId,
    /// Side of a patch (px).
    pub patch: usize,
    /// Whether the convolution predicts kernels.
    pub kernel: KernelWeights,
    /// Values for each pixel: 1, or those of a correction with weights of shares.
    pub planes: usize,
    /// Distances of the neighbours whose weights it has besides (px). See [`Op::Correct`].
    pub neighbours: Vec<usize>,
    /// An image: what the search found, where the network corrects it.
    pub base: Option<BufferId>,
}

impl HeadStep {
    /// Outputs of the convolution.
    pub(crate) fn outputs(&self) -> usize {
        let planes = self.planes + neighbours::count(&self.neighbours);
        self.patch * self.patch * planes * self.kernel.outputs_per_pixel()
    }
}

/// One pass over an image.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Normals of both layers, packed into one word a pixel, for searches that follow planes.
    Surfels {
        /// An image for each layer; that of an absent layer holds anything.
        outputs: [BufferId; 2],
    },
    /// A classic method on the frame, without its filter. See [`Op::Search`].
    Search {
        /// The method and its parameters.
        search: SearchConfig,
        /// Packed normals, if the search reads them.
        surfels: Option<[BufferId; 2]>,
        /// An image.
        output: BufferId,
    },
    /// One pass of the filter of a search.
    Filter {
        /// The search; its parameters include those of the filter.
        search: SearchConfig,
        /// What it does with the mean.
        pass: Pass,
        /// An image.
        input: BufferId,
        /// An image.
        output: BufferId,
    },
    /// The filter of a search, applied to the image. See [`ModelConfig::smooth`](crate::net::ModelConfig::smooth).
    Smooth {
        /// The search; its parameters include those of the filter.
        search: SearchConfig,
        /// What it does with the mean.
        pass: Pass,
        /// An image, for [`Pass::Correct`]: what the search found.
        base: Option<BufferId>,
        /// An image for a copy of the image, which the filter reads while it writes.
        read: BufferId,
    },
    /// Features of the frame, edge-padded to the plan's size, as patch² channels a feature.
    Features {
        /// An image: the visibility that the search found, where the network sees it.
        search: Option<BufferId>,
        /// Blocked where the channels fill their blocks and no kernels weigh the normals, planar otherwise.
        output: BufferId,
        /// Side of a patch (px).
        patch: usize,
    },
    /// Connected arcs from one pixel of every patch. See [`Op::Survey`].
    Survey {
        /// The method's parameters.
        arcs: ArcsParams,
        /// Packed normals.
        surfels: [BufferId; 2],
        /// Planar.
        output: BufferId,
        /// Side of a patch (px).
        patch: usize,
    },
    /// Resampling, concatenation, convolution, activation.
    Conv(ConvStep),
    /// 1x1 convolution, kernels over the normals (or none), patch merging, clamping: writes the image.
    Head(HeadStep),
    /// The first channel, clamped, is the image.
    Image {
        /// Blocked, at full resolution.
        input: BufferId,
    },
}
