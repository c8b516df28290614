//! Topologies: each builds a graph from a configuration.

pub(crate) mod ao_net;
pub(crate) mod deep_ao;
pub(crate) mod deep_shading;

use crate::error::Result;
use crate::net::config::{Arch, ModelConfig};
use crate::net::graph::{Activation, Graph, Op, ValueId};

impl Graph {
    /// The graph of a configuration.
    ///
    /// # Errors
    /// When the configuration is out of range.
    pub fn new(config: &ModelConfig) -> Result<Self> {
        let config = config.clone().checked()?;
        Ok(match config.arch {
            Arch::AoNet => ao_net::build(&config),
            Arch::DeepShading => deep_shading::build(&config),
            Arch::DeepAo => deep_ao::build(&config),
        })
    }
}

/// A convolution with a bias.
#[derive(Debug, Clone, Copy)]
struct Conv<'a> {
    /// Prefix of the parameter names.
    name: &'a str,
    /// Side of the filter.
    size: usize,
    groups: usize,
    activation: Activation,
    /// Channels that it computes.
    channels: usize,
}

impl<'a> Conv<'a> {
    /// A 3x3 convolution in one group, with LeakyReLU.
    fn of_3x3(name: &'a str, channels: usize) -> Self {
        Self { name, size: 3, groups: 1, activation: Activation::LeakyRelu, channels }
    }

    /// A 1x1 convolution in one group, with no activation: the head.
    fn head(channels: usize) -> Self {
        Self { name: "head", size: 1, groups: 1, activation: Activation::Linear, channels }
    }

    /// Appends the convolution to a graph.
    fn push(self, graph: &mut Graph, input: ValueId) -> ValueId {
        let Self { name, size, groups, activation, channels } = self;
        graph.push(Op::Conv { input, name: name.to_owned(), size, groups, activation }, channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::config::{Axis, Channel, Features, KernelWeights, Output, SearchConfig};
    use crate::net::graph::Node;
    use crate::search::{AgtaoParams, ArcsParams};

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
            [ModelConfig::correcting(), ModelConfig::paper()].map(|c| Graph::new(&c).unwrap());
        assert!(ours.params_count() < paper.params_count() && ours.macs_per_pixel() < paper.macs_per_pixel());
    }

    #[test]
    fn parameter_names_are_unique() {
        let params = Graph::new(&ModelConfig::correcting()).unwrap().params();
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
        assert!(error(ModelConfig { embedding: Some(0), ..ModelConfig::paper() }).contains("widths"));
        let paper = ModelConfig::paper;
        assert!(error(ModelConfig { output: Output::Correction, ..paper() }).contains("search"));
        assert!(error(ModelConfig { search: Some(SearchConfig::tuned()), ..paper() }).contains("search"));
        let shown = Features::normal().with(Channel::HorizonOcclusion);
        assert!(error(ModelConfig { features: shown, ..paper() }).contains("search"));
        let bad = SearchConfig::Agtao(AgtaoParams { power: f32::NAN, ..AgtaoParams::default() });
        assert!(error(ModelConfig { search: Some(bad), ..ModelConfig::correcting() }).contains("power"));
        let survey = |survey| ModelConfig { survey: Some(survey), ..ModelConfig::correcting() };
        assert!(
            error(survey(ArcsParams { denoise_passes: 1, ..ArcsParams::default() }))
                .contains("denoise_passes 0")
        );
        let bad = ArcsParams { denoise_passes: 0, hit: f32::NAN, ..ArcsParams::default() };
        assert!(error(survey(bad)).contains("hit"));
        let smooth = |c: ModelConfig| error(ModelConfig { smooth: true, ..c });
        assert!(
            smooth(paper()).contains("smooth") && smooth(ModelConfig::full_resolution()).contains("smooth")
        );
        let unfiltered = SearchConfig::Agtao(AgtaoParams { denoise_passes: 0, ..AgtaoParams::default() });
        let unfiltered = ModelConfig { search: Some(unfiltered), ..ModelConfig::correcting() };
        assert!(smooth(unfiltered).contains("denoise_passes above 0"));
        let mixing = |neighbours, c: ModelConfig| error(ModelConfig { neighbours, ..c });
        for distances in [vec![3, 1], vec![0], vec![9], vec![1, 1], vec![1, 2, 3, 4, 5]] {
            assert!(mixing(distances, ModelConfig::correcting()).contains("increasing distances"));
        }
        assert!(mixing(vec![1], paper()).contains("neighbours"));
        let of_baseline = ModelConfig {
            survey: Some(ArcsParams { denoise_passes: 0, ..ArcsParams::default() }),
            ..ModelConfig::deep_ao()
        };
        assert!(Graph::new(&of_baseline).is_err());
        for channels in [vec![], vec![Channel::Depth], vec![Channel::Normal(Axis::X)]] {
            assert!(error(ModelConfig { features: Features::new(channels), ..paper() }).contains("features"));
        }
        let twice = Features::normal_depth().with(Channel::Depth);
        assert!(error(ModelConfig { features: twice, ..paper() }).contains("once"));
    }

    #[test]
    fn the_first_convolution_sees_the_survey_beside_the_features() {
        let survey = Some(ArcsParams { denoise_passes: 0, ..ArcsParams::default() });
        for patch in [1, 4] {
            let graph = Graph::new(&ModelConfig { patch, survey, ..ModelConfig::correcting() }).unwrap();
            let surveys = graph.nodes().iter().filter(|node| matches!(node.op, Op::Survey { .. }));
            assert!(surveys.map(|node| (node.channels, node.stride)).eq([(6, patch)]));
            assert_eq!(graph.params()[0].shape, [32, 5 * patch * patch + 6, 3, 3]);
        }
    }

    #[test]
    fn an_embedding_reads_features_and_survey() {
        let survey = Some(ArcsParams { denoise_passes: 0, ..ArcsParams::default() });
        let config = ModelConfig { patch: 8, survey, embedding: Some(24), ..ModelConfig::correcting() };
        let params = Graph::new(&config).unwrap().params();
        let shapes =
            params.iter().filter(|p| p.name.ends_with("weight")).map(|p| (&p.name[..], &p.shape[..]));
        let first: Vec<_> = shapes.take(2).collect();
        assert_eq!(
            first,
            [("embedding.weight", &[24, 5 * 64 + 6, 1, 1][..]), ("enc0.conv0.weight", &[32, 24, 3, 3][..]),]
        );
    }

    #[test]
    fn searches_feed_what_reads_them() {
        let both = Graph::new(&ModelConfig::correcting()).unwrap();
        let search = Op::Search { search: SearchConfig::tuned() };
        assert_eq!(both.nodes()[0], Node { op: search, channels: 1, stride: 1 });
        assert!(matches!(both.nodes()[1].op, Op::Input { search: Some(0), .. }));
        assert!(matches!(both.nodes()[both.output()].op, Op::Correct { search: 0, .. }));
        let unseen = ModelConfig { features: Features::normal(), ..ModelConfig::correcting() };
        assert!(matches!(Graph::new(&unseen).unwrap().nodes()[1].op, Op::Input { search: None, .. }));
        let kernels = ModelConfig { kernel: KernelWeights::Linear, ..ModelConfig::correcting() };
        let kernels = Graph::new(&kernels).unwrap();
        let Op::Correct { correction, .. } = kernels.nodes()[kernels.output()].op else {
            panic!("no correction")
        };
        assert!(matches!(kernels.nodes()[correction].op, Op::KernelPredict { .. }));
    }
}
