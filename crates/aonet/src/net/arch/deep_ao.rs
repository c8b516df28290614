//! DeepAO. Zhang et al. 2020, from the authors' code.
//!
//! They encode normals as n/2 + 1/2: a scale and a shift that the first convolution, which has a bias, undoes.

use super::Conv;
use crate::net::config::ModelConfig;
use crate::net::graph::{Graph, Inputs, Op, ValueId};

/// Builds the graph of a checked configuration.
pub(crate) fn build(config: &ModelConfig) -> Graph {
    let (mut graph, Inputs { features: input, .. }) = Graph::begin(config);
    let mut x = conv3(&mut graph, input, "inc", config.encoder[0]);
    let mut skips = Vec::new();
    for (level, pair) in config.encoder.windows(2).enumerate() {
        skips.push(x);
        let mut side = conv3(&mut graph, input, &format!("side{level}"), pair[0]);
        for _ in 0..=level {
            side = graph.push(Op::AvgPool2 { input: side }, 0);
        }
        let pooled = graph.push(Op::AvgPool2 { input: x }, 0);
        let both = graph.push(Op::Concat { first: side, second: pooled }, 0);
        x = conv3(&mut graph, both, &format!("down{level}"), pair[1]);
    }
    for (level, (&channels, skip)) in config.decoder.iter().zip(skips.into_iter().rev()).enumerate() {
        let up = graph.push(Op::Upsample2 { input: x }, 0);
        let both = graph.push(Op::Concat { first: skip, second: up }, 0);
        x = conv3(&mut graph, both, &format!("up{level}"), channels);
    }
    Conv::head(1).push(&mut graph, x);
    graph
}

fn conv3(graph: &mut Graph, input: ValueId, name: &str, channels: usize) -> ValueId {
    Conv::of_3x3(name, channels).push(graph, input)
}
