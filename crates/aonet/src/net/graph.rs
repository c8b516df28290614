//! A network as a list of operations in SSA order. Shapes are computed here and nowhere else; `arch` builds the topology.

#[cfg(test)]
use crate::net::config::Channel;
use crate::net::config::{Features, KernelWeights, ModelConfig, SearchConfig};
use crate::net::kernel::TAPS;
use crate::search::ArcsParams;
pub use crate::search::survey::SURVEYED;

/// Index of a [`Node`] and of the tensor that it produces.
pub type ValueId = usize;

/// Slope of LeakyReLU below zero.
pub const LEAKY_SLOPE: f32 = 0.01;

/// What follows a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// Nothing.
    Linear,
    /// max(x, [`LEAKY_SLOPE`] x).
    LeakyRelu,
}

impl Activation {
    /// Factor of negative values.
    pub fn slope(self) -> f32 {
        match self {
            Self::Linear => 1.0,
            Self::LeakyRelu => LEAKY_SLOPE,
        }
    }
}

/// One operation. Tensors are CxHxW, row-major; images repeat their edge beyond the border.
#[derive(Debug, Clone, PartialEq)]
pub enum Op {
    /// A classic method on the frame, with its filter: HxW visibility, 1 on the background, and after it each share that it reports.
    Search {
        /// The method and its parameters.
        search: SearchConfig,
    },
    /// The features of the frame; the first three channels are the view-space normal.
    Input {
        /// The channels.
        features: Features,
        /// What the search found, if channels show it.
        search: Option<ValueId>,
    },
    /// Connected arcs from one pixel of every patch, the one at (patch / 2, patch / 2): the shares of light, 0 on the background,
    /// and 1 everywhere if the frame has a second layer. [`SURVEYED`] channels.
    Survey {
        /// The method's parameters; its filter is not used.
        arcs: ArcsParams,
        /// Side (px).
        patch: usize,
    },
    /// Squares of `patch` x `patch` pixels become channels: channel `c * patch² + dy * patch + dx`.
    PatchPartition {
        /// CxHxW.
        input: ValueId,
        /// Side (px).
        patch: usize,
    },
    /// The inverse of `PatchPartition`.
    PatchMerge {
        /// C·patch² x H x W.
        input: ValueId,
        /// Side (px).
        patch: usize,
    },
    /// `size` x `size` convolution with bias; parameters `{name}.weight` (OIHW, I of one group) and `{name}.bias` (O).
    Conv {
        /// CxHxW.
        input: ValueId,
        /// Prefix of the parameter names.
        name: String,
        /// Side of the filter: 1 or 3.
        size: usize,
        /// Input and output channels fall into this many groups; an output sees the inputs of its group.
        groups: usize,
        /// What follows.
        activation: Activation,
    },
    /// Mean of 2x2 pixels.
    AvgPool2 {
        /// CxHxW.
        input: ValueId,
    },
    /// Bilinear upsampling by two, pixel centres at half-integers.
    Upsample2 {
        /// CxHxW.
        input: ValueId,
    },
    /// Channels of `first`, then channels of `second`.
    Concat {
        /// CxHxW.
        first: ValueId,
        /// DxHxW.
        second: ValueId,
    },
    /// The visibility of the search, plus the first plane of a correction, plus the product of every further plane and the share
    /// of light in the same plane of the search: 1xHxW. The last planes are weights of neighbours, in units of
    /// [`UNIT`](crate::net::neighbours::UNIT): each is multiplied with the neighbour's visibility minus the pixel's, as the search found
    /// them.
    Correct {
        /// The search.
        search: ValueId,
        /// CxHxW, with one plane or as many as the search, and one for each neighbour.
        correction: ValueId,
        /// Distances of the neighbours (px): [`ModelConfig::neighbours`](crate::net::ModelConfig::neighbours).
        neighbours: Vec<usize>,
        /// Whether sessions then smooth the image, by the search's filter: [`ModelConfig::smooth`](crate::net::ModelConfig::smooth).
        /// Training and ONNX leave it out.
        smooth: bool,
    },
    /// Weighs the 4x4 neighbourhood of the normals of every pixel: AO-Net Eq. 2.
    /// Kernel channel `((dy * patch + dx) * 16 + ky * 4 + kx) * 3 + c` of the patch's cell belongs to pixel
    /// (dy, dx) of the patch, tap (ky, kx) at offset -1..=2, normal component c. Produces 1 x pH x pW.
    KernelPredict {
        /// patch²·48 x H x W.
        kernels: ValueId,
        /// The value whose first three channels are weighted; pH x pW.
        guide: ValueId,
        /// Side (px).
        patch: usize,
        /// Never `Off`.
        weights: KernelWeights,
    },
}

/// An operation and the shape of what it produces.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// The operation.
    pub op: Op,
    /// Channels of the result.
    pub channels: usize,
    /// The result has one cell for `stride` x `stride` input pixels.
    pub stride: usize,
}

/// Name and shape of one parameter tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParamSpec {
    /// Unique name, such as `enc0.conv1.weight`.
    pub name: String,
    /// OIHW for weights, O for biases.
    pub shape: Vec<usize>,
}

/// Operations in SSA order; the last one is the output, 1xHxW visibility before clamping.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    nodes: Vec<Node>,
    pub(crate) init: Init,
}

/// What the operations of a topology begin with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inputs {
    pub(crate) features: ValueId,
    pub(crate) search: Option<ValueId>,
}

/// How training starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Init {
    /// He et al. 2015; the head starts near a bright image.
    He,
    /// Narrow normal distributions: Nalbach et al. 2017, from their network files.
    DeepShading,
}

impl Graph {
    /// A graph that holds what networks read, for `arch`: the search, if there is one, and the features.
    pub(crate) fn begin(config: &ModelConfig) -> (Self, Inputs) {
        let mut graph = Self { nodes: Vec::new(), init: Init::He };
        let search = config.search.map(|search| graph.push(Op::Search { search }, 1));
        let shown = search.filter(|_| config.features.show_a_search());
        let input = Op::Input { features: config.features.clone(), search: shown };
        let features = graph.push(input, 0);
        (graph, Inputs { features, search })
    }

    /// A graph with features of `channels` channels alone.
    #[cfg(test)]
    pub(crate) fn with_input(channels: usize) -> (Self, ValueId) {
        let features = Features::new(vec![Channel::Depth; channels]);
        let input = Node { op: Op::Input { features, search: None }, channels, stride: 1 };
        (Self { nodes: vec![input], init: Init::He }, 0)
    }

    /// Appends an operation and computes its shape, for `arch`. `conv_channels` are those of a convolution.
    pub(crate) fn push(&mut self, op: Op, conv_channels: usize) -> ValueId {
        let of = |v: ValueId| (self.nodes[v].channels, self.nodes[v].stride);
        let (channels, stride) = match &op {
            Op::Search { search } => (search.planes(), 1),
            Op::Input { features, .. } => (features.channels().len(), 1),
            Op::Survey { patch, .. } => (SURVEYED, *patch),
            Op::PatchPartition { input, patch } => (of(*input).0 * patch * patch, of(*input).1 * patch),
            Op::PatchMerge { input, patch } => (of(*input).0 / (patch * patch), of(*input).1 / patch),
            Op::Conv { input, .. } => (conv_channels, of(*input).1),
            Op::AvgPool2 { input } => (of(*input).0, of(*input).1 * 2),
            Op::Upsample2 { input } => (of(*input).0, of(*input).1 / 2),
            Op::Concat { first, second } => (of(*first).0 + of(*second).0, of(*first).1),
            Op::KernelPredict { kernels, patch, .. } => (1, of(*kernels).1 / patch),
            Op::Correct { correction, .. } => (1, of(*correction).1),
        };
        self.nodes.push(Node { op, channels, stride });
        self.nodes.len() - 1
    }

    /// The operations.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The value that holds the visibility.
    pub fn output(&self) -> ValueId {
        self.nodes.len() - 1
    }

    /// Width and height must be multiples of this (px); runtimes pad by repeating the edge.
    pub fn alignment(&self) -> usize {
        self.nodes.iter().map(|n| n.stride).max().unwrap_or(1)
    }

    /// Every parameter tensor, in graph order: the exact contract of a weights file.
    pub fn params(&self) -> Vec<ParamSpec> {
        let mut params = Vec::new();
        for node in &self.nodes {
            if let Op::Conv { input, name, size, groups, .. } = &node.op {
                let shape = vec![node.channels, self.nodes[*input].channels / groups, *size, *size];
                params.push(ParamSpec { name: format!("{name}.weight"), shape });
                params.push(ParamSpec { name: format!("{name}.bias"), shape: vec![node.channels] });
            }
        }
        params
    }

    /// Number of scalar parameters.
    pub fn params_count(&self) -> usize {
        self.params().iter().map(|p| p.shape.iter().product::<usize>()).sum()
    }

    /// Multiply-accumulates per input pixel: those of convolutions, kernels and weights of shares. A search has none; it is counted
    /// where it is timed.
    pub fn macs_per_pixel(&self) -> f64 {
        self.nodes.iter().map(|node| self.node_macs(node)).sum()
    }

    /// The same of one node.
    pub fn node_macs(&self, node: &Node) -> f64 {
        match &node.op {
            Op::Conv { input, size, groups, .. } => {
                (node.channels * self.nodes[*input].channels / groups * size * size) as f64
                    / (node.stride * node.stride) as f64
            }
            Op::KernelPredict { .. } => TAPS as f64,
            Op::Correct { correction, .. } => (self.nodes[*correction].channels - 1) as f64,
            Op::Search { .. }
            | Op::Input { .. }
            | Op::Survey { .. }
            | Op::PatchPartition { .. }
            | Op::PatchMerge { .. }
            | Op::AvgPool2 { .. }
            | Op::Upsample2 { .. }
            | Op::Concat { .. } => 0.0,
        }
    }
}
