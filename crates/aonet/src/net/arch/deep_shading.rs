//! Deep Shading, the network for AO. Nalbach et al. 2017, from the authors' network files.
//!
//! Their convolutions see zeros beyond the image; here, as everywhere, the edge is repeated.

use super::Conv;
use crate::net::config::ModelConfig;
use crate::net::graph::{Graph, Init, Inputs, Op};

/// Output channels of a group; the first and last convolutions have one group.
const GROUP: usize = 8;

/// Builds the graph of a checked configuration.
pub(crate) fn build(config: &ModelConfig) -> Graph {
    let (mut graph, Inputs { features: mut x, .. }) = Graph::begin(config);
    graph.init = Init::DeepShading;
    let mut skips = Vec::new();
    for (level, &channels) in config.encoder.iter().enumerate() {
        if level > 0 {
            skips.push(x);
            x = graph.push(Op::AvgPool2 { input: x }, 0);
        }
        let name = format!("down{level}");
        x = grouped(&name, channels).push(&mut graph, x);
    }
    for (&channels, skip) in config.decoder.iter().zip(skips.into_iter().rev()) {
        let up = graph.push(Op::Upsample2 { input: x }, 0);
        x = graph.push(Op::Concat { first: up, second: skip }, 0);
        let name = format!("up{}", groups(channels).ilog2());
        x = grouped(&name, channels).push(&mut graph, x);
    }
    graph
}

/// Groups of a convolution of so many channels.
fn groups(channels: usize) -> usize {
    (channels / GROUP).max(1)
}

fn grouped(name: &str, channels: usize) -> Conv<'_> {
    Conv { groups: groups(channels), ..Conv::of_3x3(name, channels) }
}
