//! How a graph runs at one size: padding, fused steps, and where each buffer lies in one arena.
//!
//! A plan knows no device and no tensor. What is fused, always:
//! * patch partition into the features: the input is stored partitioned, once, for the network and the kernels;
//! * pooling, upsampling and concatenation into the convolution that reads them ([`Source`]);
//! * the 1x1 head, kernel prediction and patch merging into one step ([`Step::Head`]): the kernels, 48 values a
//!   pixel, never exist in memory.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::net::config::KernelWeights;
use crate::net::graph::{Activation, Graph, Op, ValueId};

/// Channels of blocked buffers are rounded up to a multiple of this: the widest vector of any backend.
pub const CHANNEL_BLOCK: usize = 16;

/// Pixels that every row carries on each side of the image, for 3x3 convolutions.
pub const HALO: usize = 1;

/// Index into [`Plan::buffers`].
pub type BufferId = usize;

/// How the values of a row are ordered. Rows always come one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Channel by channel, each a line of pixels with its halo.
    Planar,
    /// Block of channels by block of channels, each a line of pixels with its halo, channels innermost.
    Blocked,
}

/// A tensor in the arena.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Buffer {
    /// First value in the arena.
    pub offset: usize,
    /// Order of the values.
    pub layout: Layout,
    /// Channels that hold values.
    pub channels: usize,
    /// Rows.
    pub height: usize,
    /// Columns, without the halo.
    pub width: usize,
    /// Steps that write it first and read it last.
    pub live: (usize, usize),
}

impl Buffer {
    /// Values from the start of one row to the next.
    pub fn row_len(&self) -> usize {
        let channels = match self.layout {
            Layout::Planar => self.channels,
            Layout::Blocked => self.channels.next_multiple_of(CHANNEL_BLOCK),
        };
        channels * (self.width + 2 * HALO)
    }

    /// Values in all.
    pub fn len(&self) -> usize {
        self.height * self.row_len()
    }

    /// Never: every buffer has a row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where it lies in the arena.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.offset..self.offset + self.len()
    }
}

/// What happens to a buffer on its way into a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resample {
    /// Nothing.
    None,
    /// [`Op::AvgPool2`] one or more times: the mean of squares of this side [px].
    AvgPool(usize),
    /// [`Op::Upsample2`].
    Upsample2,
}

/// One of the inputs of a convolution; their channels follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// What is read.
    pub buffer: BufferId,
    /// How.
    pub resample: Resample,
}

/// One pass over an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Features of the frame, edge-padded to the plan's size, as patch² channels a feature.
    Features {
        /// Planar.
        output: BufferId,
        /// Side of a patch [px].
        patch: usize,
    },
    /// Resampling, concatenation, convolution, activation.
    Conv {
        /// Prefix of the parameter names.
        name: String,
        /// One or more.
        sources: Vec<Source>,
        /// Blocked.
        output: BufferId,
        /// Side of the filter: 1 or 3.
        size: usize,
        /// See [`Op::Conv`].
        groups: usize,
        /// What follows.
        activation: Activation,
    },
    /// 1x1 convolution, kernels over the normals (or none), patch merging, clamping: writes the image.
    Head {
        /// Prefix of the parameter names.
        name: String,
        /// Blocked.
        input: BufferId,
        /// The partitioned features.
        guide: BufferId,
        /// Side of a patch [px].
        patch: usize,
        /// How the output is formed.
        kernel: KernelWeights,
    },
    /// The first channel, clamped, is the image.
    Image {
        /// Blocked, at full resolution.
        input: BufferId,
    },
}

/// A graph at one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// Size of the image (width, height) [px].
    pub size: (usize, usize),
    /// The same, padded to the graph's alignment.
    pub padded: (usize, usize),
    /// Every tensor that is stored.
    pub buffers: Vec<Buffer>,
    /// In order of execution.
    pub steps: Vec<Step>,
    /// Length of the arena [values].
    pub arena_len: usize,
}

impl Plan {
    /// The plan of `graph` for images of `width` x `height` [px].
    ///
    /// # Errors
    /// When a side is 0 or too large.
    ///
    /// # Panics
    /// When the graph holds a combination that no topology of this crate builds.
    pub fn new(graph: &Graph, width: usize, height: usize) -> Result<Self> {
        Size::new(width, height)?;
        let step = graph.alignment();
        let padded = (width.next_multiple_of(step), height.next_multiple_of(step));
        let mut lowering = Lowering { graph, padded, buffers: Vec::new(), steps: Vec::new() };
        lowering.features();
        let mut values = Vec::new();
        for id in 0..graph.nodes().len() {
            values.push(lowering.node(id, &values));
        }
        // Without patches and kernels the last convolution itself is the image.
        match values.last() {
            Some(head @ Lowered::Head { .. }) => drop(lowering.head(head, 1, KernelWeights::Off)),
            Some(Lowered::Sources(sources)) => lowering.image(sources),
            Some(Lowered::Features(_) | Lowered::Image) | None => {}
        }
        let Lowering { mut buffers, steps, .. } = lowering;
        let arena_len = place(&mut buffers).ok_or_else(|| {
            Error::size("plan", "an image that fits in memory", format!("{width} x {height}"))
        })?;
        Ok(Self { size: (width, height), padded, buffers, steps, arena_len })
    }

    /// Bytes that move if every step reads its inputs and writes its output once: a floor for memory traffic.
    /// Counts f32 activations, not parameters.
    pub fn traffic_bytes(&self) -> usize {
        let bytes = |id: BufferId| self.buffers[id].len() * size_of::<f32>();
        let image = self.size.0 * self.size.1 * size_of::<f32>();
        let of_step = |step: &Step| match step {
            Step::Features { output, .. } => bytes(*output),
            Step::Conv { sources, output, .. } => {
                bytes(*output) + sources.iter().map(|s| bytes(s.buffer)).sum::<usize>()
            }
            Step::Head { input, guide, .. } => bytes(*input) + bytes(*guide) + image,
            Step::Image { input } => bytes(*input) + image,
        };
        self.steps.iter().map(of_step).sum()
    }
}

/// What a node of the graph became.
#[derive(Debug, Clone)]
enum Lowered {
    /// The partitioned features, seen with patches of this side.
    Features(usize),
    /// Something that a convolution can read.
    Sources(Vec<Source>),
    /// The 1x1 convolution of the head, waiting for what follows it.
    Head { name: String, input: BufferId },
    /// Written to the image.
    Image,
}

struct Lowering<'a> {
    graph: &'a Graph,
    padded: (usize, usize),
    buffers: Vec<Buffer>,
    steps: Vec<Step>,
}

/// The features are the first buffer.
const FEATURES: BufferId = 0;

impl Lowering<'_> {
    fn features(&mut self) {
        let partition = |op: &Op| if let Op::PatchPartition { patch, .. } = op { Some(*patch) } else { None };
        let nodes = self.graph.nodes();
        let patch = nodes.iter().find_map(|n| partition(&n.op)).unwrap_or(1);
        let output = self.buffer(Layout::Planar, nodes[0].channels * patch * patch, patch);
        self.steps.push(Step::Features { output, patch });
    }

    /// A new buffer that the next step writes.
    fn buffer(&mut self, layout: Layout, channels: usize, stride: usize) -> BufferId {
        let (width, height) = (self.padded.0 / stride, self.padded.1 / stride);
        let step = self.steps.len();
        self.buffers.push(Buffer { offset: 0, layout, channels, height, width, live: (step, step) });
        self.buffers.len() - 1
    }

    fn node(&mut self, id: ValueId, values: &[Lowered]) -> Lowered {
        match &self.graph.nodes()[id].op {
            Op::Input => Lowered::Features(1),
            Op::PatchPartition { input, patch } => match values[*input] {
                Lowered::Features(1) => Lowered::Features(*patch),
                _ => panic!("only the features can be partitioned"),
            },
            Op::Conv { input, name, size, groups, activation } => {
                let sources = self.sources(&values[*input]);
                if self.is_head(id) {
                    let [Source { buffer, resample: Resample::None }] = sources[..] else {
                        panic!("the head reads a convolution");
                    };
                    return Lowered::Head { name: name.clone(), input: buffer };
                }
                self.conv((name, *size, *groups, *activation), id, sources)
            }
            Op::AvgPool2 { input } => resampled(&values[*input], Resample::AvgPool(2)),
            Op::Upsample2 { input } => resampled(&values[*input], Resample::Upsample2),
            Op::Concat { first, second } => {
                let both = [self.sources(&values[*first]), self.sources(&values[*second])];
                Lowered::Sources(both.concat())
            }
            Op::KernelPredict { kernels, patch, weights, .. } => {
                self.head(&values[*kernels], *patch, *weights)
            }
            Op::Correct { correction, .. } => self.correct(&values[*correction]),
            Op::PatchMerge { input, patch } => self.head(&values[*input], *patch, KernelWeights::Off),
        }
    }

    /// Whether a convolution is the last one, so that its result goes into the image and nowhere else.
    fn is_head(&self, id: ValueId) -> bool {
        let nodes = self.graph.nodes();
        let last = nodes.iter().rposition(|n| matches!(n.op, Op::Conv { .. }));
        let plain = |activation: &Activation| *activation == Activation::Linear;
        last == Some(id)
            && matches!(&nodes[id].op, Op::Conv { size: 1, groups: 1, activation, .. } if plain(activation))
    }

    fn sources(&self, value: &Lowered) -> Vec<Source> {
        match value {
            Lowered::Features(_) => vec![Source { buffer: FEATURES, resample: Resample::None }],
            Lowered::Sources(sources) => sources.clone(),
            Lowered::Head { .. } | Lowered::Image => panic!("the head writes the image"),
        }
    }

    fn conv(&mut self, of: (&str, usize, usize, Activation), id: ValueId, sources: Vec<Source>) -> Lowered {
        let (name, size, groups, activation) = of;
        let node = &self.graph.nodes()[id];
        let output = self.buffer(Layout::Blocked, node.channels, node.stride);
        sources.iter().for_each(|s| self.read(s.buffer));
        self.steps.push(Step::Conv { name: name.to_owned(), sources, output, size, groups, activation });
        Lowered::Sources(vec![Source { buffer: output, resample: Resample::None }])
    }

    fn head(&mut self, conv: &Lowered, patch: usize, kernel: KernelWeights) -> Lowered {
        let Lowered::Head { name, input } = conv else { panic!("the image comes from the head") };
        self.read(*input);
        self.read(FEATURES);
        let (name, input) = (name.clone(), *input);
        self.steps.push(Step::Head { name, input, guide: FEATURES, patch, kernel });
        Lowered::Image
    }

    /// The head that wrote the image, or is about to, writes what the features lack instead.
    fn correct(&mut self, correction: &Lowered) -> Lowered {
        if matches!(correction, Lowered::Head { .. }) {
            return self.head(correction, 1, KernelWeights::Correction);
        }
        let Some(Step::Head { kernel, .. }) = self.steps.last_mut() else {
            panic!("a correction comes from the head")
        };
        *kernel = KernelWeights::Correction;
        Lowered::Image
    }

    fn image(&mut self, sources: &[Source]) {
        let [Source { buffer, resample: Resample::None }] = *sources else {
            panic!("the image is a convolution")
        };
        self.read(buffer);
        self.steps.push(Step::Image { input: buffer });
    }

    /// Keeps a buffer until the next step.
    fn read(&mut self, id: BufferId) {
        self.buffers[id].live.1 = self.steps.len();
    }
}

fn resampled(value: &Lowered, resample: Resample) -> Lowered {
    match value {
        Lowered::Sources(sources) => match sources[..] {
            [Source { buffer, resample: Resample::None }] => {
                Lowered::Sources(vec![Source { buffer, resample }])
            }
            [Source { buffer, resample: Resample::AvgPool(side) }] if resample == Resample::AvgPool(2) => {
                Lowered::Sources(vec![Source { buffer, resample: Resample::AvgPool(2 * side) }])
            }
            _ => panic!("only convolutions are resampled"),
        },
        Lowered::Features(_) | Lowered::Head { .. } | Lowered::Image => {
            panic!("only convolutions are resampled")
        }
    }
}

/// Puts each buffer at the lowest offset where no buffer that lives at the same time is; returns the arena's
/// length, or none if it would not fit in the address space.
fn place(buffers: &mut [Buffer]) -> Option<usize> {
    let mut arena_len = 0usize;
    for i in 0..buffers.len() {
        let (placed, rest) = buffers.split_at_mut(i);
        let buffer = &mut rest[0];
        let mut taken: Vec<_> = placed
            .iter()
            .filter(|b| b.live.0 <= buffer.live.1 && buffer.live.0 <= b.live.1)
            .map(|b| b.range())
            .collect();
        taken.sort_by_key(|range| range.start);
        let len = buffer.height.checked_mul(buffer.row_len())?;
        let mut offset = 0usize;
        for range in taken {
            if offset.checked_add(len)? <= range.start {
                break;
            }
            offset = offset.max(range.end.next_multiple_of(CHANNEL_BLOCK));
        }
        buffer.offset = offset;
        arena_len = arena_len.max(offset.checked_add(len)?);
    }
    (arena_len <= isize::MAX as usize / size_of::<f32>()).then_some(arena_len)
}
