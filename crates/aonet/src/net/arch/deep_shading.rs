//! Deep Shading, the network for AO. Nalbach et al. 2017, from the authors' network files.
//!
//! Their convolutions see zeros beyond the image; here, as everywhere, the edge is repeated.

use super::conv;
use crate::net::config::ModelConfig;
use crate::net::graph::{Activation, Graph, Init, Inputs, Op};

/// Output channels of a group; the first and last convolutions have one group.
const GROUP: usize = 8;

/// Builds the graph of a checked configuration.
pub(crate) fn build(config: &ModelConfig) -> Graph {
    let (mut graph, Inputs { features: mut x, .. }) = Graph::begin(config);
    graph.init = Init::DeepShading;
    let groups = |channels: usize| (channels / GROUP).max(1);
    let mut skips = Vec::new();
    for (level, &channels) in config.encoder.iter().enumerate() {
        if level > 0 {
            skips.push(x);
            x = graph.push(Op::AvgPool2 { input: x }, 0);
        }
        let name = format!("down{level}");
        x = conv(&mut graph, x, (&name, 3, groups(channels), Activation::LeakyRelu), channels);
    }
    for (&channels, skip) in config.decoder.iter().zip(skips.into_iter().rev()) {
        let up = graph.push(Op::Upsample2 { input: x }, 0);
        x = graph.push(Op::Concat { first: up, second: skip }, 0);
        let name = format!("up{}", groups(channels).ilog2());
        x = conv(&mut graph, x, (&name, 3, groups(channels), Activation::LeakyRelu), channels);
    }
    graph
}
