//! What every step of a plan costs, at least and in fact.

use super::searches::{FILTER_FLOP, search_cost};
use super::time_steps;
use aonet::net::cpu::Options;
use aonet::net::graph::TAPS;
use aonet::net::plan::{BufferId, Plan, Resample, Source, Step};
use aonet::net::{KernelWeights, Model};
use aonet_scene::Result;
use serde::Serialize;

/// Channels and bytes of a pixel of the G-buffer: normal and depth.
const GBUFFER_CHANNELS: usize = 4;
const GBUFFER_BYTES: usize = GBUFFER_CHANNELS * size_of::<f32>();

/// What a step has to do, whoever does it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpCost {
    /// Prefix of its parameters, or what it makes.
    pub name: String,
    /// What happens in it, in order.
    pub kind: String,
    /// Channels that it reads.
    pub inputs: usize,
    /// Channels that it computes; of a head, those of its convolution.
    pub outputs: usize,
    /// Of what it writes (px or cells).
    pub width: usize,
    /// Of what it writes (px or cells).
    pub height: usize,
    /// Operations: two for each multiply-add of a direct convolution and of the kernels; those of a search and its filter as
    /// `search_cost` counts them.
    pub flop: f64,
    /// Bytes of inputs, outputs and parameters as f32, each once, without padding.
    pub bytes: f64,
}

/// A step and its time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpTime {
    /// What it has to do.
    #[serde(flatten)]
    pub cost: OpCost,
    /// Median (ms).
    pub median_ms: f64,
}

/// Costs and times of all steps, measured as [`super::time`] does.
///
/// # Errors
/// As [`super::time`].
pub fn time_ops(model: &Model, size: (usize, usize), options: Options, runs: usize) -> Result<Vec<OpTime>> {
    let plan = Plan::new(model.graph(), size.0, size.1)?;
    let times = time_steps(model, size, options, runs)?;
    let with_time = |(step, median_ms)| OpTime { cost: cost((model, &plan), step), median_ms };
    Ok(plan.steps.iter().zip(times).map(with_time).collect())
}

pub(super) fn cost(of: (&Model, &Plan), step: &Step) -> OpCost {
    let (model, plan) = of;
    let (width, height) = plan.size;
    let pixels = width * height;
    match step {
        Step::Search { search, output } => {
            let method = search.method();
            let kind = format!("{}, {} taps", method.name(), method.taps());
            let bytes = pixels * GBUFFER_BYTES + buffer_bytes(plan, *output);
            let flop = search_cost(&method).map_or(0.0, |cost| cost.search) * pixels as f64;
            op(("search", kind), (GBUFFER_CHANNELS, plan, *output), (flop, bytes))
        }
        Step::Filter { input, output, .. } => {
            let bytes = pixels * GBUFFER_BYTES + buffer_bytes(plan, *input) + buffer_bytes(plan, *output);
            let flop = FILTER_FLOP * pixels as f64;
            op(("filter", "5x5, by plane and normal".into()), (1, plan, *output), (flop, bytes))
        }
        Step::Features { search, output, patch } => {
            let inputs = model.config().features.channels().len();
            let kind = format!("features, patches of {patch}");
            let found = search.map_or(0, |id| buffer_bytes(plan, id));
            let bytes = pixels * GBUFFER_BYTES + found + buffer_bytes(plan, *output);
            op(("features", kind), (inputs, plan, *output), (0.0, bytes))
        }
        Step::Conv { name, sources, output, size, groups, .. } => {
            let inputs: usize = sources.iter().map(|s| plan.buffers[s.buffer].channels).sum();
            let read: usize = sources.iter().map(|s| buffer_bytes(plan, s.buffer)).sum();
            let bytes = read + buffer_bytes(plan, *output) + parameter_bytes(model, name);
            let out = &plan.buffers[*output];
            let macs = out.channels * inputs / groups * size * size * out.width * out.height;
            let kind = format!("{}conv {size}x{size}", before(sources));
            op((name, kind), (inputs, plan, *output), (2.0 * macs as f64, bytes))
        }
        Step::Head { name, input, guide, kernel, base, .. } => {
            let (cells, outputs) = (&plan.buffers[*input], head_outputs(model, name));
            let (what, taps) = match kernel {
                KernelWeights::Off => ("merge", 0),
                KernelWeights::Linear => ("kernels", TAPS),
                KernelWeights::Softmax => ("softmax kernels", TAPS),
            };
            // The guide where kernels weigh it, what is corrected, depths for the background, the image.
            let guide = if taps > 0 { buffer_bytes(plan, *guide) } else { 0 };
            let bytes = buffer_bytes(plan, *input)
                + guide
                + base.map_or(0, |id| buffer_bytes(plan, id))
                + 2 * pixels * size_of::<f32>()
                + parameter_bytes(model, name);
            let macs = cells.channels * outputs * cells.width * cells.height + taps * pixels;
            let what = match (base, kernel) {
                (None, _) => what.to_owned(),
                (Some(_), KernelWeights::Off) => "correct".to_owned(),
                (Some(_), KernelWeights::Linear | KernelWeights::Softmax) => format!("{what}, correct"),
            };
            let kind = format!("conv 1x1, {what}");
            let cost = op((name, kind), (cells.channels, plan, *input), (2.0 * macs as f64, bytes));
            OpCost { outputs, width, height, ..cost }
        }
        Step::Image { input } => {
            let bytes = buffer_bytes(plan, *input) + 2 * pixels * size_of::<f32>();
            let channels = plan.buffers[*input].channels;
            let cost = op(("image", "clamp".to_owned()), (channels, plan, *input), (0.0, bytes));
            OpCost { width, height, ..cost }
        }
    }
}

fn op(
    (name, kind): (&str, String),
    (inputs, plan, output): (usize, &Plan, BufferId),
    (flop, bytes): (f64, usize),
) -> OpCost {
    let out = &plan.buffers[output];
    let (outputs, width, height) = (out.channels, out.width, out.height);
    OpCost { name: name.to_owned(), kind, inputs, outputs, width, height, flop, bytes: bytes as f64 }
}

/// What happens to the inputs of a convolution on their way into it.
fn before(sources: &[Source]) -> String {
    let resampled = |s: &Source| match s.resample {
        Resample::None => String::new(),
        Resample::AvgPool(side) => format!("pool {side}, "),
        Resample::Upsample2 => "upsample, ".to_owned(),
    };
    let concat = if sources.len() > 1 { "concat, " } else { "" };
    sources.iter().map(resampled).collect::<String>() + concat
}

fn buffer_bytes(plan: &Plan, id: BufferId) -> usize {
    let buffer = &plan.buffers[id];
    buffer.channels * buffer.width * buffer.height * size_of::<f32>()
}

fn parameter_bytes(model: &Model, name: &str) -> usize {
    let of = |part: &str| model.weights().get(&format!("{name}.{part}")).values.len();
    (of("weight") + of("bias")) * size_of::<f32>()
}

fn head_outputs(model: &Model, name: &str) -> usize {
    model.weights().get(&format!("{name}.bias")).values.len()
}

#[cfg(test)]
mod tests {
    use super::super::tests::model;
    use super::*;
    use aonet::net::ModelConfig;

    fn costs(config: ModelConfig, size: (usize, usize)) -> (Model, Vec<OpCost>) {
        let model = model(config);
        let plan = Plan::new(model.graph(), size.0, size.1).unwrap();
        let costs = plan.steps.iter().map(|step| cost((&model, &plan), step)).collect();
        (model, costs)
    }

    #[test]
    fn operations_add_up_to_what_the_graph_counts() {
        let networks = [
            ModelConfig::paper(),
            ModelConfig::any_radius(),
            ModelConfig::deep_shading(),
            ModelConfig::deep_ao(),
            ModelConfig::full_resolution(),
        ];
        for config in networks {
            // A size that every network takes without padding.
            let (width, height) = (256, 128);
            let (model, costs) = costs(config.clone(), (width, height));
            let searches = ["search", "filter"];
            let network = costs.iter().filter(|c| !searches.contains(&c.name.as_str()));
            let found: f64 = network.map(|c| c.flop).sum();
            let expected = 2.0 * model.graph().macs_per_pixel() * (width * height) as f64;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected} {config:?}");
        }
    }

    #[test]
    fn costs_are_those_worked_out_by_hand() {
        let (_, costs) = costs(ModelConfig::paper(), (64, 32));
        let last_decoder = costs.iter().find(|c| c.name == "dec0.conv0").expect("the finest decoder level");
        assert_eq!(last_decoder.kind, "upsample, concat, conv 3x3");
        assert_eq!((last_decoder.inputs, last_decoder.outputs), (48 + 32, 32));
        assert_eq!((last_decoder.width, last_decoder.height), (16, 8));
        let cells = 16 * 8;
        assert_eq!(last_decoder.flop, (2 * 9 * 80 * 32 * cells) as f64);
        // The coarser 48 channels, the skip's 32, the output's 32; weights and biases.
        let values = 48 * cells / 4 + 32 * cells + 32 * cells + 9 * 80 * 32 + 32;
        assert_eq!(last_decoder.bytes, (4 * values) as f64);
        let head = costs.last().unwrap();
        assert_eq!((head.kind.as_str(), head.inputs, head.outputs), ("conv 1x1, kernels", 32, 768));
        assert_eq!((head.width, head.height), (64, 32));
    }

    #[test]
    fn a_search_and_its_filter_are_counted_by_themselves() {
        let (_, costs) = costs(ModelConfig::any_radius(), (64, 64));
        let names: Vec<_> = costs[..3].iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["search", "filter", "features"]);
        assert_eq!(costs[0].kind, "agtao, 36 taps");
        let pixels = (64 * 64) as f64;
        // Normal and depth, and what was found: once written, once read and written, once read. Features of 5 channels.
        let bytes: Vec<_> = costs[..3].iter().map(|c| c.bytes / pixels).collect();
        assert_eq!(bytes, [20.0, 24.0, 20.0 + 20.0]);
        assert_eq!(costs[0].flop / pixels, 120.0 + 3.0 * 160.0 + 36.0 * 80.0);
        assert_eq!(costs.last().unwrap().kind, "conv 1x1, correct");
    }
}
