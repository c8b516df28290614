//! From the operations of a graph to the steps of a plan.

use super::buffer::{Buffer, BufferId, CHANNEL_BLOCK, Layout, Lifetime};
use super::step::{ConvStep, HeadStep, Resample, Source, Step};
use crate::frame::size::Size;
use crate::net::config::{KernelWeights, SearchConfig};
use crate::net::graph::{Activation, Graph, Op, SURVEYED, ValueId};
use crate::net::neighbours;
use crate::search::{ArcsParams, BEND, KEEP, Pass};

/// What a node of the graph became: where its value is.
#[derive(Debug, Clone)]
enum Lowered {
    /// The visibility that a search found.
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

/// The buffers and steps of a graph at one size, so far.
pub(super) struct Lowering<'a> {
    graph: &'a Graph,
    size: Size,
    padded: Size,
    with_bent_normals: bool,
    /// What a search with bent normals found, if they are wanted: the first plane is the visibility, the last ones are the bend.
    pub(super) bent: Option<BufferId>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) steps: Vec<Step>,
}

impl<'a> Lowering<'a> {
    /// Lowers a whole graph.
    pub(super) fn new(graph: &'a Graph, (size, padded): (Size, Size), with_bent_normals: bool) -> Self {
        let (buffers, steps) = (vec![], vec![]);
        let mut lowering = Self { graph, size, padded, with_bent_normals, bent: None, buffers, steps };
        let mut values = Vec::new();
        for id in 0..graph.nodes().len() {
            values.push(lowering.node(id, &values));
        }
        // Without patches and kernels the last convolution itself is the image.
        match values.last() {
            Some(head @ Lowered::Head { .. }) => drop(lowering.head(head, (1, 1), KernelWeights::Off)),
            Some(Lowered::Sources(sources)) => lowering.image(sources),
            Some(Lowered::Search(_) | Lowered::Features { .. } | Lowered::Image) | None => {}
        }
        // The caller reads it after the last step.
        if let Some(bent) = lowering.bent {
            lowering.buffers[bent].live.last = lowering.steps.len();
        }
        lowering
    }

    fn search(&mut self, search: SearchConfig) -> Lowered {
        let bend = if self.with_bent_normals { BEND } else { 0 };
        let found = self.filtered_search(search, search.planes() + bend);
        self.bent = self.with_bent_normals.then_some(found);
        Lowered::Search(found)
    }

    /// A search that reports so many values for a pixel, and its filter.
    fn filtered_search(&mut self, search: SearchConfig, planes: usize) -> BufferId {
        let surfels = match search {
            SearchConfig::Agtao(_) => None,
            SearchConfig::Arcs(_) => Some(self.surfels()),
        };
        let mut found = self.image_buffer(planes);
        surfels.into_iter().flatten().for_each(|surfels| self.read(surfels));
        self.steps.push(Step::Search { search, surfels, output: found });
        for pass in search.filter().passes() {
            let output = self.image_buffer(planes);
            self.read(found);
            self.steps.push(Step::Filter { search, pass, input: found, output });
            found = output;
        }
        found
    }

    /// Packed normals of both layers.
    fn surfels(&mut self) -> [BufferId; 2] {
        let outputs = [(); 2].map(|()| self.image_buffer(1));
        self.steps.push(Step::Surfels { outputs });
        outputs
    }

    fn survey(&mut self, arcs: ArcsParams, patch: usize) -> Lowered {
        let surfels = self.surfels();
        let output = self.buffer(Layout::Planar, SURVEYED, patch);
        surfels.into_iter().for_each(|surfels| self.read(surfels));
        self.steps.push(Step::Survey { arcs, surfels, output, patch });
        Lowered::Sources(vec![Source { buffer: output, resample: Resample::None }])
    }

    fn features(&mut self, channels: usize, search: Option<&Lowered>) -> Lowered {
        let partition = |op: &Op| if let Op::PatchPartition { patch, .. } = op { Some(*patch) } else { None };
        let patch = self.graph.nodes().iter().find_map(|n| partition(&n.op)).unwrap_or(1);
        let search = search.map(|lowered| match *lowered {
            Lowered::Search(found) => found,
            _ => panic!("features show what a search found"),
        });
        search.into_iter().for_each(|found| self.read(found));
        let channels = channels * patch * patch;
        // Kernels weigh planar normals.
        let kernels = self.graph.nodes().iter().any(|node| matches!(node.op, Op::KernelPredict { .. }));
        let whole_blocks = channels.is_multiple_of(CHANNEL_BLOCK);
        let layout = if whole_blocks && !kernels { Layout::Blocked } else { Layout::Planar };
        let output = self.buffer(layout, channels, patch);
        self.steps.push(Step::Features { search, output, patch });
        Lowered::Features { buffer: output, patch: 1 }
    }

    /// A new image that the next step writes.
    fn image_buffer(&mut self, channels: usize) -> BufferId {
        self.add(Layout::Image, channels, self.size)
    }

    /// A new buffer that the next step writes.
    fn buffer(&mut self, layout: Layout, channels: usize, stride: usize) -> BufferId {
        let size = Size::px(self.padded.width() / stride, self.padded.height() / stride);
        self.add(layout, channels, size)
    }

    fn add(&mut self, layout: Layout, channels: usize, size: Size) -> BufferId {
        let (width, height) = (size.width(), size.height());
        let live = Lifetime { first: self.steps.len(), last: self.steps.len() };
        self.buffers.push(Buffer { offset: 0, layout, channels, height, width, live });
        self.buffers.len() - 1
    }

    fn node(&mut self, id: ValueId, values: &[Lowered]) -> Lowered {
        let node = &self.graph.nodes()[id];
        match &node.op {
            Op::Search { search } => self.search(*search),
            Op::Input { search, .. } => self.features(node.channels, search.map(|id| &values[id])),
            Op::Survey { arcs, patch } => self.survey(*arcs, *patch),
            Op::PatchPartition { input, patch } => match values[*input] {
                Lowered::Features { buffer, patch: 1 } => Lowered::Features { buffer, patch: *patch },
                _ => panic!("only the features can be partitioned"),
            },
            Op::Conv { input, .. } => {
                let sources = self.sources(&values[*input]);
                if self.is_head(id) { self.pending_head(id, &sources) } else { self.conv(id, sources) }
            }
            Op::AvgPool2 { input } => resampled(&values[*input], Resample::AvgPool(2)),
            Op::Upsample2 { input } => resampled(&values[*input], Resample::Upsample2),
            Op::Concat { first, second } => {
                let both = [self.sources(&values[*first]), self.sources(&values[*second])];
                Lowered::Sources(both.concat())
            }
            Op::KernelPredict { kernels, patch, weights, .. } => {
                self.head(&values[*kernels], (*patch, 1), *weights)
            }
            Op::Correct { search, correction, neighbours, smooth } => {
                let planes = self.graph.nodes()[*correction].channels - neighbours::count(neighbours);
                let found = self.correct(&values[*search], &values[*correction], (planes, neighbours));
                if *smooth {
                    self.smooth(*search, (planes == 1).then_some(found));
                }
                Lowered::Image
            }
            Op::PatchMerge { input, patch } => {
                self.head(&values[*input], (*patch, node.channels), KernelWeights::Off)
            }
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

    fn pending_head(&self, id: ValueId, sources: &[Source]) -> Lowered {
        let Op::Conv { name, .. } = &self.graph.nodes()[id].op else { panic!("the head is a convolution") };
        let [Source { buffer, resample: Resample::None }] = *sources else {
            panic!("the head reads a convolution");
        };
        Lowered::Head { name: name.clone(), input: buffer }
    }

    fn conv(&mut self, id: ValueId, sources: Vec<Source>) -> Lowered {
        let node = &self.graph.nodes()[id];
        let Op::Conv { name, size, groups, activation, .. } = &node.op else { panic!("not a convolution") };
        let (name, size, groups, activation) = (name.clone(), *size, *groups, *activation);
        let output = self.buffer(Layout::Blocked, node.channels, node.stride);
        sources.iter().for_each(|s| self.read(s.buffer));
        self.steps.push(Step::Conv(ConvStep { name, sources, output, size, groups, activation }));
        Lowered::Sources(vec![Source { buffer: output, resample: Resample::None }])
    }

    fn head(&mut self, conv: &Lowered, (patch, planes): (usize, usize), kernel: KernelWeights) -> Lowered {
        let Lowered::Head { name, input } = conv else { panic!("the image comes from the head") };
        let features =
            |step: &Step| if let Step::Features { output, .. } = step { Some(*output) } else { None };
        let guide = self.steps.iter().find_map(features).expect("features come first");
        self.read(*input);
        self.read(guide);
        let (name, input) = (name.clone(), *input);
        self.steps.push(Step::Head(HeadStep {
            name,
            input,
            guide,
            patch,
            kernel,
            planes,
            neighbours: vec![],
            base: None,
        }));
        Lowered::Image
    }

    /// Lets the head correct what the search found; returns where that is.
    fn correct(
        &mut self,
        search: &Lowered,
        correction: &Lowered,
        (planes, neighbours): (usize, &[usize]),
    ) -> BufferId {
        if matches!(correction, Lowered::Head { .. }) {
            self.head(correction, (1, planes), KernelWeights::Off);
        }
        let Lowered::Search(found) = *search else { panic!("only a search can be corrected") };
        let Some(Step::Head(head)) = self.steps.last_mut() else {
            panic!("a correction comes from the head")
        };
        head.base = Some(found);
        head.planes = planes;
        head.neighbours = neighbours.to_vec();
        self.buffers[found].live.last = self.steps.len() - 1;
        found
    }

    /// Smooths the image, or what a search found and what the head added to it each for itself.
    fn smooth(&mut self, search: ValueId, base: Option<BufferId>) {
        let Op::Search { search } = self.graph.nodes()[search].op else {
            panic!("only a search is corrected")
        };
        let pass = if base.is_some() { Pass::Correct { keep: KEEP } } else { Pass::Settle { keep: KEEP } };
        let read = self.image_buffer(1);
        base.into_iter().for_each(|base| self.read(base));
        self.steps.push(Step::Smooth { search, pass, base, read });
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
        self.buffers[id].live.last = self.steps.len();
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
