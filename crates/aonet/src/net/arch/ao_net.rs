//! AO-Net §3.2–3.3: a U-Net over patches whose head predicts kernels over the normals.

use super::Conv;
use crate::net::config::{KernelWeights, ModelConfig, Output, Skips};
use crate::net::graph::{Graph, Op, ValueId};
use crate::net::neighbours;

/// Builds the graph of a checked configuration.
pub(crate) fn build(config: &ModelConfig) -> Graph {
    let (mut graph, inputs) = Graph::begin(config);
    let input = inputs.features;
    let patch = config.patch;
    let mut x = if patch > 1 { graph.push(Op::PatchPartition { input, patch }, 0) } else { input };
    if let Some(arcs) = config.survey {
        let survey = graph.push(Op::Survey { arcs, patch }, 0);
        x = graph.push(Op::Concat { first: x, second: survey }, 0);
    }
    if let Some(channels) = config.embedding {
        x = Conv { size: 1, ..Conv::of_3x3("embedding", channels) }.push(&mut graph, x);
    }
    let mut skips = Vec::new();
    for (level, &channels) in config.encoder.iter().enumerate() {
        if level > 0 {
            skips.push(x);
            x = graph.push(Op::AvgPool2 { input: x }, 0);
        }
        x = double_conv(&mut graph, x, &format!("enc{level}"), channels);
    }
    for (i, &channels) in config.decoder.iter().enumerate() {
        let level = config.decoder.len() - 1 - i;
        let up = graph.push(Op::Upsample2 { input: x }, 0);
        x = match config.skips {
            Skips::Concat => graph.push(Op::Concat { first: up, second: skips[level] }, 0),
            Skips::None => up,
        };
        x = double_conv(&mut graph, x, &format!("dec{level}"), channels);
    }
    x = match config.kernel {
        KernelWeights::Off => {
            let planes = match (config.output, config.search) {
                (Output::Shares, Some(search)) => search.planes(),
                _ => 1,
            };
            let planes = planes + neighbours::count(&config.neighbours);
            let x = Conv::head(patch * patch * planes).push(&mut graph, x);
            if patch > 1 { graph.push(Op::PatchMerge { input: x, patch }, 0) } else { x }
        }
        weights @ (KernelWeights::Linear | KernelWeights::Softmax) => {
            let outputs = patch * patch * weights.outputs_per_pixel();
            let kernels = Conv::head(outputs).push(&mut graph, x);
            graph.push(Op::KernelPredict { kernels, guide: input, patch, weights }, 0)
        }
    };
    match (config.output, inputs.search) {
        (Output::Correction | Output::Shares, Some(search)) => {
            let (neighbours, smooth) = (config.neighbours.clone(), config.smooth);
            graph.push(Op::Correct { search, correction: x, neighbours, smooth }, 0);
        }
        (Output::Correction | Output::Shares, None) => {
            unreachable!("a checked configuration has a search to correct")
        }
        (Output::Visibility, _) => {}
    }
    graph
}

fn double_conv(graph: &mut Graph, input: ValueId, name: &str, channels: usize) -> ValueId {
    let x = Conv::of_3x3(&format!("{name}.conv0"), channels).push(graph, input);
    Conv::of_3x3(&format!("{name}.conv1"), channels).push(graph, x)
}
