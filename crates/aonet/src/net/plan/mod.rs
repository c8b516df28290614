//! How a graph runs at one size: padding, fused steps, and where each buffer lies in one arena.
//!
//! A plan knows no device and no tensor. What is fused, always:
//! * patch partition into the features: the input is stored partitioned, once, for the network and the kernels;
//! * pooling, upsampling and concatenation into the convolution that reads them ([`Source`]);
//! * the 1x1 head, kernel prediction and patch merging into one step ([`Step::Head`]): the kernels, 48 values a
//!   pixel, never exist in memory;
//! * the correction of a search into the same step.
//!
//! A search becomes several steps instead: the method itself, and every pass of its filter.

mod buffer;
mod lowering;
mod step;

pub use buffer::{Buffer, BufferId, CHANNEL_BLOCK, HALO, Layout, Lifetime};
pub use step::{ConvStep, HeadStep, Resample, Source, Step};

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::net::graph::Graph;
use buffer::place;
use lowering::Lowering;

/// A graph at one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Size of the image.
    pub size: Size,
    /// The same, padded to the graph's alignment.
    pub padded: Size,
    /// All stored tensors.
    pub buffers: Vec<Buffer>,
    /// In order of execution.
    pub steps: Vec<Step>,
    /// Length of the arena (values).
    pub arena_len: usize,
}

impl Plan {
    /// The plan of `graph` for images of `size`.
    ///
    /// # Errors
    /// When the buffers do not fit in memory.
    ///
    /// # Panics
    /// When the graph holds a combination that no topology of this crate builds.
    pub fn new(graph: &Graph, size: Size) -> Result<Self> {
        Ok(Self::lowered(graph, size, false)?.0)
    }

    /// The same with a buffer that holds what the network's search found at the end, the bend in its last planes.
    ///
    /// # Errors
    /// As [`Plan::new`], and when the network has no search.
    ///
    /// # Panics
    /// As [`Plan::new`].
    pub fn with_bent_normals(graph: &Graph, size: Size) -> Result<(Self, BufferId)> {
        let (plan, bent) = Self::lowered(graph, size, true)?;
        let missing = || {
            let expected = "a network with a search, such as fast, balanced or high";
            Error::value("network with bent normals", expected, "one without a search")
        };
        Ok((plan, bent.ok_or_else(missing)?))
    }

    fn lowered(graph: &Graph, size: Size, with_bent_normals: bool) -> Result<(Self, Option<BufferId>)> {
        let step = graph.alignment();
        let padded = Size::new(size.width().next_multiple_of(step), size.height().next_multiple_of(step))?;
        let lowering = Lowering::new(graph, (size, padded), with_bent_normals);
        let Lowering { mut buffers, steps, bent, .. } = lowering;
        let arena_len =
            place(&mut buffers).ok_or_else(|| Error::size("plan", "an image that fits in memory", size))?;
        Ok((Self { size, padded, buffers, steps, arena_len }, bent))
    }

    /// Columns and rows of the patches of the padded image; `patch` is their side (px).
    pub fn cells(&self, patch: usize) -> Size {
        Size::px(self.padded.width() / patch, self.padded.height() / patch)
    }

    /// Bytes that move if every step reads its inputs and writes its output once: a floor for memory traffic.
    /// Counts f32 activations, not parameters.
    pub fn traffic_bytes(&self) -> usize {
        let bytes = |id: BufferId| self.buffers[id].len() * size_of::<f32>();
        let image = self.size.pixels() * size_of::<f32>();
        let of_step = |step: &Step| match step {
            Step::Surfels { outputs } => outputs.iter().map(|id| bytes(*id)).sum(),
            Step::Search { surfels, output, .. } => {
                bytes(*output) + surfels.iter().flatten().map(|id| bytes(*id)).sum::<usize>()
            }
            Step::Filter { input, output, .. } => bytes(*input) + bytes(*output),
            Step::Smooth { base, read, .. } => base.map_or(0, bytes) + 2 * bytes(*read) + 2 * image,
            Step::Features { search, output, .. } => bytes(*output) + search.map_or(0, bytes),
            Step::Survey { surfels, output, .. } => {
                bytes(*output) + surfels.iter().map(|id| bytes(*id)).sum::<usize>()
            }
            Step::Conv(ConvStep { sources, output, .. }) => {
                bytes(*output) + sources.iter().map(|s| bytes(s.buffer)).sum::<usize>()
            }
            Step::Head(HeadStep { input, guide, base, .. }) => {
                bytes(*input) + bytes(*guide) + base.map_or(0, bytes) + image
            }
            Step::Image { input } => bytes(*input) + image,
        };
        self.steps.iter().map(of_step).sum()
    }
}
