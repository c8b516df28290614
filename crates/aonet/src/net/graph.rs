//! A network as a list of operations in SSA order. Topology and shapes are computed here and nowhere else.

use crate::error::Result;
use crate::net::arch;
#[cfg(test)]
use crate::net::config::Channel;
use crate::net::config::{Arch, Features, KernelWeights, ModelConfig, SearchConfig};

/// Index of a [`Node`] and of the tensor that it produces.
pub type ValueId = usize;

/// Side of the kernel window (px). AO-Net §3.3.
pub const WINDOW: usize = 4;

/// Offset of the first tap from the pixel (px): a 4x4 window has no centre, ours covers -1..=2.
pub const FIRST_TAP: isize = -1;

/// Number of channels that kernels weigh: the normal.
pub const GUIDE_CHANNELS: usize = 3;

/// Kernel weights per pixel.
pub const TAPS: usize = WINDOW * WINDOW * GUIDE_CHANNELS;

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
    /// A classic method on the frame, with its filter: 1xHxW visibility, 1 on the background.
    Search {
        /// The method and its parameters.
        search: SearchConfig,
    },
    /// The features of the frame; the first three channels are the view-space normal.
    Input {
        /// The channels.
        features: Features,
        /// 1xHxW: what [`Channel::HorizonOcclusion`](crate::net::Channel::HorizonOcclusion) shows, if it is a channel.
        search: Option<ValueId>,
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
    /// The visibility of the search plus a correction: 1xHxW.
    Correct {
        /// 1xHxW.
        search: ValueId,
        /// 1xHxW.
        correction: ValueId,
    },
    /// Weighs the 4x4 neighbourhood of the normals of every pixel: AO-Net Eq. 2.
    /// Kernel channel `((dy * patch + dx) * 16 + ky * 4 + kx) * 3 + c` of the patch's cell belongs to pixel
    /// (dy, dx) of the patch, tap (ky, kx) at offset -1..=2, normal component c. Produces 1 x pH x pW.
    KernelPredict {
        /// patch²·48 x H x W.
        kernels: ValueId,
        /// The value whose first three channels are weighed; pH x pW.
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
    /// The graph of a configuration.
    ///
    /// # Errors
    /// When the configuration is out of range.
    pub fn new(config: &ModelConfig) -> Result<Self> {
        let config = config.clone().checked()?;
        Ok(match config.arch {
            Arch::AoNet => arch::ao_net::build(&config),
            Arch::DeepShading => arch::deep_shading::build(&config),
            Arch::DeepAo => arch::deep_ao::build(&config),
        })
    }

    /// A graph that holds what networks read, for `arch`: the search, if there is one, and the features.
    pub(crate) fn begin(config: &ModelConfig) -> (Self, Inputs) {
        let mut graph = Self { nodes: Vec::new(), init: Init::He };
        let search = config.search.map(|search| graph.push(Op::Search { search }, 1));
        let shown = config.features.horizon().and(search);
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
            Op::Search { .. } => (1, 1),
            Op::Input { features, .. } => (features.channels().len(), 1),
            Op::PatchPartition { input, patch } => (of(*input).0 * patch * patch, of(*input).1 * patch),
            Op::PatchMerge { input, patch } => (of(*input).0 / (patch * patch), of(*input).1 / patch),
            Op::Conv { input, .. } => (conv_channels, of(*input).1),
            Op::AvgPool2 { input } => (of(*input).0, of(*input).1 * 2),
            Op::Upsample2 { input } => (of(*input).0, of(*input).1 / 2),
            Op::Concat { first, second } => (of(*first).0 + of(*second).0, of(*first).1),
            Op::KernelPredict { kernels, patch, .. } => (1, of(*kernels).1 / patch),
            Op::Correct { correction, .. } => of(*correction),
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

    /// Multiply-accumulates per input pixel: those of convolutions and kernels. A search has none; it is counted where it
    /// is timed.
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
            Op::Search { .. }
            | Op::Input { .. }
            | Op::PatchPartition { .. }
            | Op::PatchMerge { .. }
            | Op::AvgPool2 { .. }
            | Op::Upsample2 { .. }
            | Op::Correct { .. }
            | Op::Concat { .. } => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::config::{Axis, Output};
    use crate::search::AgtaoParams;

    #[test]
    fn the_papers_network_has_the_sizes_worked_out_by_hand() {
        let graph = Graph::new(&ModelConfig::paper()).unwrap();
        assert_eq!(graph.alignment(), 32);
        let last = &graph.nodes()[graph.output()];
        assert_eq!((last.channels, last.stride), (1, 1));
        let conv = |i: usize, o: usize| i * o * 9 + o;
        let expected = conv(48, 32)
            + conv(32, 32)
            + conv(32, 48)
            + conv(48, 48)
            + conv(48, 64)
            + conv(64, 64)
            + conv(64, 96)
            + conv(96, 96)
            + conv(160, 64)
            + conv(64, 64)
            + conv(112, 48)
            + conv(48, 48)
            + conv(80, 32)
            + conv(32, 32)
            + 32 * 768
            + 768;
        assert_eq!(graph.params_count(), expected);
        assert!(graph.params_count() * 2 < 1_500_000, "half floats must stay under the paper's 1.5 MB");
    }

    #[test]
    fn all_four_rows_of_table_4_are_configs() {
        for patch in [1, 4] {
            for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
                let config = ModelConfig { patch, kernel, ..ModelConfig::paper() };
                let graph = Graph::new(&config).unwrap();
                let last = &graph.nodes()[graph.output()];
                assert_eq!((last.channels, last.stride), (1, 1), "{config:?}");
            }
        }
    }

    #[test]
    fn the_baselines_have_their_published_sizes() {
        let of = |config| Graph::new(&config).unwrap();
        let (deep_shading, deep_ao) = (of(ModelConfig::deep_shading()), of(ModelConfig::deep_ao()));
        assert_eq!((deep_shading.params_count(), deep_ao.params_count()), (71_089, 45_405));
        assert_eq!(deep_shading.macs_per_pixel().round(), 2_547.0);
        assert_eq!(deep_ao.macs_per_pixel().round(), 3_532.0);
    }

    #[test]
    fn ours_costs_less_than_the_papers() {
        let [ours, paper] =
            [ModelConfig::any_radius(), ModelConfig::paper()].map(|c| Graph::new(&c).unwrap());
        assert!(ours.params_count() < paper.params_count() && ours.macs_per_pixel() < paper.macs_per_pixel());
    }

    #[test]
    fn parameter_names_are_unique() {
        let params = Graph::new(&ModelConfig::any_radius()).unwrap().params();
        let names: std::collections::BTreeSet<_> = params.iter().map(|p| &p.name).collect();
        assert_eq!(names.len(), params.len());
    }

    #[test]
    fn bad_configs_are_refused_by_field() {
        let error = |c: ModelConfig| Graph::new(&c).unwrap_err().to_string();
        assert!(error(ModelConfig { patch: 3, ..ModelConfig::paper() }).contains("patch"));
        assert!(error(ModelConfig { encoder: vec![], ..ModelConfig::paper() }).contains("encoder"));
        assert!(error(ModelConfig { decoder: vec![8], ..ModelConfig::paper() }).contains("decoder"));
        assert!(
            error(ModelConfig { encoder: vec![32, 48, 64, 0], ..ModelConfig::paper() }).contains("widths")
        );
        let paper = ModelConfig::paper;
        assert!(error(ModelConfig { output: Output::Correction, ..paper() }).contains("search"));
        assert!(error(ModelConfig { search: Some(SearchConfig::tuned()), ..paper() }).contains("search"));
        let shown = Features::normal().with(Channel::HorizonOcclusion);
        assert!(error(ModelConfig { features: shown, ..paper() }).contains("search"));
        let bad = SearchConfig::Agtao(AgtaoParams { power: f32::NAN, ..AgtaoParams::default() });
        assert!(error(ModelConfig { search: Some(bad), ..ModelConfig::any_radius() }).contains("power"));
        for channels in [vec![], vec![Channel::Depth], vec![Channel::Normal(Axis::X)]] {
            assert!(error(ModelConfig { features: Features::new(channels), ..paper() }).contains("features"));
        }
        let twice = Features::normal_depth().with(Channel::Depth);
        assert!(error(ModelConfig { features: twice, ..paper() }).contains("once"));
    }

    #[test]
    fn searches_feed_what_reads_them() {
        let both = Graph::new(&ModelConfig::any_radius()).unwrap();
        let search = Op::Search { search: SearchConfig::tuned() };
        assert_eq!(both.nodes()[0], Node { op: search, channels: 1, stride: 1 });
        assert!(matches!(both.nodes()[1].op, Op::Input { search: Some(0), .. }));
        assert!(matches!(both.nodes()[both.output()].op, Op::Correct { search: 0, .. }));
        let unseen = ModelConfig { features: Features::normal(), ..ModelConfig::any_radius() };
        assert!(matches!(Graph::new(&unseen).unwrap().nodes()[1].op, Op::Input { search: None, .. }));
        let kernels = ModelConfig { kernel: KernelWeights::Linear, ..ModelConfig::any_radius() };
        let kernels = Graph::new(&kernels).unwrap();
        let Op::Correct { correction, .. } = kernels.nodes()[kernels.output()].op else {
            panic!("no correction")
        };
        assert!(matches!(kernels.nodes()[correction].op, Op::KernelPredict { .. }));
    }
}
