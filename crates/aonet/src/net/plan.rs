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

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::net::config::{KernelWeights, SearchConfig};
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
    /// The frame's own pixels, without halo: one channel.
    Image,
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
        match self.layout {
            Layout::Planar => self.channels * (self.width + 2 * HALO),
            Layout::Blocked => self.channels.next_multiple_of(CHANNEL_BLOCK) * (self.width + 2 * HALO),
            Layout::Image => self.width,
        }
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
    /// [`Op::AvgPool2`] one or more times: the mean of squares of this side (px).
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
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// A classic method on the frame, without its filter. See [`Op::Search`].
    Search {
        /// The method and its parameters.
        search: SearchConfig,
        /// An image.
        output: BufferId,
    },
    /// One pass of the filter of a search.
    Filter {
        /// The search, whose parameters the filter's are part of.
        search: SearchConfig,
        /// An image.
        input: BufferId,
        /// An image.
        output: BufferId,
    },
    /// Features of the frame, edge-padded to the plan's size, as patch² channels a feature.
    Features {
        /// An image: what the search found, where the network sees it.
        search: Option<BufferId>,
        /// Planar.
        output: BufferId,
        /// Side of a patch (px).
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
        /// Side of a patch (px).
        patch: usize,
        /// Whether the convolution predicts kernels.
        kernel: KernelWeights,
        /// An image: the visibility that is added to, where the network corrects a search.
        base: Option<BufferId>,
    },
    /// The first channel, clamped, is the image.
    Image {
        /// Blocked, at full resolution.
        input: BufferId,
    },
}

/// A graph at one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Size of the image (width, height) (px).
    pub size: (usize, usize),
    /// The same, padded to the graph's alignment.
    pub padded: (usize, usize),
    /// Every tensor that is stored.
    pub buffers: Vec<Buffer>,
    /// In order of execution.
    pub steps: Vec<Step>,
    /// Length of the arena (values).
    pub arena_len: usize,
}

impl Plan {
    /// The plan of `graph` for images of `width` x `height` (px).
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
        let mut lowering = Lowering { graph, size: (width, height), padded, buffers: vec![], steps: vec![] };
        let mut values = Vec::new();
        for id in 0..graph.nodes().len() {
            values.push(lowering.node(id, &values));
        }
        // Without patches and kernels the last convolution itself is the image.
        match values.last() {
            Some(head @ Lowered::Head { .. }) => drop(lowering.head(head, 1, KernelWeights::Off)),
            Some(Lowered::Sources(sources)) => lowering.image(sources),
            Some(Lowered::Search(_) | Lowered::Features { .. } | Lowered::Image) | None => {}
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
            Step::Search { output, .. } => bytes(*output),
            Step::Filter { input, output, .. } => bytes(*input) + bytes(*output),
            Step::Features { search, output, .. } => bytes(*output) + search.map_or(0, bytes),
            Step::Conv { sources, output, .. } => {
                bytes(*output) + sources.iter().map(|s| bytes(s.buffer)).sum::<usize>()
            }
            Step::Head { input, guide, base, .. } => {
                bytes(*input) + bytes(*guide) + base.map_or(0, bytes) + image
            }
            Step::Image { input } => bytes(*input) + image,
        };
        self.steps.iter().map(of_step).sum()
    }
}

/// What a node of the graph became.
#[derive(Debug, Clone)]
enum Lowered {
    /// What a search found.
    Search(BufferId),
    /// The partitioned features, seen with patches of this side (px).
    Features { buffer: BufferId, patch: usize },
    /// Something that a convolution can read.
    Sources(Vec<Source>),
    /// The 1x1 convolution of the head, waiting for what follows it.
    Head { name: String, input: BufferId },
    /// Written to the image.
    Image,
}

struct Lowering<'a> {
    graph: &'a Graph,
    size: (usize, usize),
    padded: (usize, usize),
    buffers: Vec<Buffer>,
    steps: Vec<Step>,
}

impl Lowering<'_> {
    fn search(&mut self, search: SearchConfig) -> Lowered {
        let mut found = self.image_buffer();
        self.steps.push(Step::Search { search, output: found });
        for _ in 0..search.filter().passes {
            let output = self.image_buffer();
            self.read(found);
            self.steps.push(Step::Filter { search, input: found, output });
            found = output;
        }
        Lowered::Search(found)
    }

    fn features(&mut self, channels: usize, search: Option<&Lowered>) -> Lowered {
        let partition = |op: &Op| if let Op::PatchPartition { patch, .. } = op { Some(*patch) } else { None };
        let patch = self.graph.nodes().iter().find_map(|n| partition(&n.op)).unwrap_or(1);
        let search = search.map(|lowered| match *lowered {
            Lowered::Search(found) => found,
            _ => panic!("features show what a search found"),
        });
        search.into_iter().for_each(|found| self.read(found));
        let output = self.buffer(Layout::Planar, channels * patch * patch, patch);
        self.steps.push(Step::Features { search, output, patch });
        Lowered::Features { buffer: output, patch: 1 }
    }

    /// A new image that the next step writes.
    fn image_buffer(&mut self) -> BufferId {
        let ((width, height), step) = (self.size, self.steps.len());
        let layout = Layout::Image;
        self.buffers.push(Buffer { offset: 0, layout, channels: 1, height, width, live: (step, step) });
        self.buffers.len() - 1
    }

    /// A new buffer that the next step writes.
    fn buffer(&mut self, layout: Layout, channels: usize, stride: usize) -> BufferId {
        let (width, height) = (self.padded.0 / stride, self.padded.1 / stride);
        let step = self.steps.len();
        self.buffers.push(Buffer { offset: 0, layout, channels, height, width, live: (step, step) });
        self.buffers.len() - 1
    }

    fn node(&mut self, id: ValueId, values: &[Lowered]) -> Lowered {
        let node = &self.graph.nodes()[id];
        match &node.op {
            Op::Search { search } => self.search(*search),
            Op::Input { search, .. } => self.features(node.channels, search.map(|id| &values[id])),
            Op::PatchPartition { input, patch } => match values[*input] {
                Lowered::Features { buffer, patch: 1 } => Lowered::Features { buffer, patch: *patch },
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
            Op::Correct { search, correction } => self.correct(&values[*search], &values[*correction]),
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
            Lowered::Features { buffer, .. } => vec![Source { buffer: *buffer, resample: Resample::None }],
            Lowered::Sources(sources) => sources.clone(),
            Lowered::Search(_) => panic!("convolutions see a search as a feature"),
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
        let features =
            |step: &Step| if let Step::Features { output, .. } = step { Some(*output) } else { None };
        let guide = self.steps.iter().find_map(features).expect("features come first");
        self.read(*input);
        self.read(guide);
        let (name, input) = (name.clone(), *input);
        self.steps.push(Step::Head { name, input, guide, patch, kernel, base: None });
        Lowered::Image
    }

    /// The head that wrote the image, or is about to, adds to what the search found.
    fn correct(&mut self, search: &Lowered, correction: &Lowered) -> Lowered {
        if matches!(correction, Lowered::Head { .. }) {
            self.head(correction, 1, KernelWeights::Off);
        }
        let Lowered::Search(found) = *search else { panic!("only a search can be corrected") };
        let Some(Step::Head { base, .. }) = self.steps.last_mut() else {
            panic!("a correction comes from the head")
        };
        *base = Some(found);
        self.buffers[found].live.1 = self.steps.len() - 1;
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
        Lowered::Search(_) | Lowered::Features { .. } | Lowered::Head { .. } | Lowered::Image => {
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
