//! A network's time by level: AO-Net §3.2 and Fig. 3.

use crate::timing;
use aonet::Size;
use aonet::internals::graph::{Graph, Node, Op};
use aonet::internals::plan::{ConvStep, HeadStep, Plan, Step};
use aonet::net::Model;
use aonet::net::cpu::Options;
use aonet_scene::Result;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A part of a U-Net, in order of execution. Levels are named by the pixels a side of their cells.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    /// Computing the features.
    Features,
    /// Convolutions of the encoder.
    Encoder(usize),
    /// Convolutions of the decoder.
    Decoder(Reverse<usize>),
    /// The last convolution, kernels, patch merging and clamping.
    Head,
}

impl Level {
    /// `enc 1:4` has a cell for 4x4 pixels.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Features => "features".into(),
            Self::Encoder(stride) => format!("enc 1:{stride}"),
            Self::Decoder(Reverse(stride)) => format!("dec 1:{stride}"),
            Self::Head => "head".into(),
        }
    }
}

/// Cost of a level.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub(super) struct Cost {
    /// Median run-time (ms).
    pub(super) ms: f64,
    /// Multiply-accumulates of its convolutions and kernels in one frame.
    pub(super) macs: f64,
}

/// Cost of every level of a U-Net at `size`.
///
/// # Errors
/// When the session cannot be made.
pub(super) fn costs(model: &Model, size: Size, threads: usize, runs: usize) -> Result<BTreeMap<Level, Cost>> {
    let plan = Plan::new(model.graph(), size)?;
    let times = timing::time_steps(model, size, Options { threads, ..Options::default() }, runs)?;
    let mut costs: BTreeMap<Level, Cost> = BTreeMap::new();
    for (step, ms) in plan.steps.iter().zip(times) {
        let (level, per_pixel) = place(model.graph(), step);
        let cost = costs.entry(level).or_default();
        cost.ms += ms;
        cost.macs += per_pixel * size.pixels() as f64;
    }
    Ok(costs)
}

/// The level of a step, and its multiply-accumulates a pixel.
fn place(graph: &Graph, step: &Step) -> (Level, f64) {
    match step {
        Step::Surfels { .. }
        | Step::Search { .. }
        | Step::Filter { .. }
        | Step::Features { .. }
        | Step::Survey { .. } => (Level::Features, 0.0),
        Step::Conv(ConvStep { name, .. }) => {
            let (stride, macs) = conv(graph, name);
            let up = name.starts_with("dec") || name.starts_with("up");
            (if up { Level::Decoder(Reverse(stride)) } else { Level::Encoder(stride) }, macs)
        }
        Step::Head(HeadStep { name, .. }) => {
            let weighted = |n: &Node| matches!(n.op, Op::KernelPredict { .. }).then(|| graph.node_macs(n));
            (Level::Head, conv(graph, name).1 + graph.nodes().iter().find_map(weighted).unwrap_or(0.0))
        }
        Step::Image { .. } | Step::Smooth { .. } => (Level::Head, 0.0),
    }
}

/// Pixels a side of a convolution's cells, and its multiply-accumulates a pixel: one a weight and cell.
fn conv(graph: &Graph, of: &str) -> (usize, f64) {
    let node = graph.nodes().iter().find(|n| matches!(&n.op, Op::Conv { name, .. } if name == of));
    let stride = node.map_or(1, |n| n.stride);
    let weight = format!("{of}.weight");
    let weights = graph.params().iter().find(|p| p.name == weight).map_or(0, |p| p.shape.iter().product());
    (stride, weights as f64 / (stride * stride) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::internals::weights::Weights;
    use aonet::net::{KernelWeights, ModelConfig, TrainingFacts};

    #[test]
    fn levels_come_in_order_and_add_up_to_the_network() {
        for (patch, kernel) in [(1, KernelWeights::Linear), (4, KernelWeights::Off)] {
            let (encoder, decoder) = (vec![4, 6, 8], vec![6, 4]);
            let config = ModelConfig { patch, kernel, encoder, decoder, ..ModelConfig::paper() };
            let graph = Graph::new(&config).unwrap();
            let weights = Weights::init(&graph, 1);
            let expected = graph.macs_per_pixel() * (64.0 * 32.0);
            let model = Model::new(config, weights, TrainingFacts::default()).unwrap();
            let costs = costs(&model, Size::px(64, 32), 1, 1).unwrap();
            let names: Vec<String> = costs.keys().map(Level::name).collect();
            let stride = |l: usize| patch << l;
            let levels = [("enc", 0), ("enc", 1), ("enc", 2), ("dec", 1), ("dec", 0)];
            let levels = levels.map(|(side, l)| format!("{side} 1:{}", stride(l)));
            assert_eq!(names, [&["features".to_owned()], &levels[..], &["head".to_owned()]].concat());
            let macs: f64 = costs.values().map(|c| c.macs).sum();
            assert!((macs - expected).abs() < 1e-6 * expected, "{macs} {expected}");
            assert!(costs.values().all(|c| c.ms > 0.0));
        }
    }
}
