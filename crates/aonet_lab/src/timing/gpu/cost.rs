//! What every pass of a frame has to do, whatever the device.

use crate::timing::ops;
use crate::timing::searches::{FILTER_FLOP, SearchCost, parameter, search_cost};
use aonet::Size;
use aonet::gpu::Precision;
use aonet::internals::plan::{BufferId, ConvStep, HeadStep, Plan, Step};
use aonet::net::{Channel, KernelWeights, Model};
use aonet::search::Classic;
use serde::Serialize;

/// What a pass has to do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PassCost {
    /// As the session calls it.
    pub pass: String,
    /// Operations: two for each multiply-add of direct convolutions; of the other passes counted in their shaders by hand,
    /// roots, logarithms and exponents as one.
    pub flop: f64,
    /// Bytes of textures and buffers that it reads and writes, each once.
    pub bytes: f64,
}

/// Bytes of a pixel of the timed frames' textures, `Rgba16Float`, `R32Float` and `R8Unorm`.
const NORMAL: f64 = 8.0;
const DEPTH: f64 = 4.0;
const OUTPUT: f64 = 1.0;
/// Bytes of a pixel's packed normal.
const SURFEL: f64 = 4.0;
/// Bytes of a pixel of what passes hand over.
const VISIBILITY: f64 = 4.0;

/// Operations of a pixel of the small passes.
const DEPTH_RANGE: f64 = 6.0;
const SURFELS: f64 = 115.0;
const FEATURES: f64 = 30.0;
const IMAGE: f64 = 8.0;
/// A cell for every four of the finer level, a third as many as pixels in all.
const PYRAMID: f64 = 35.0 / 3.0;

/// The passes of a network's frame in order, for sessions of this size.
///
/// # Errors
/// When the buffers do not fit in memory.
pub fn network_costs(model: &Model, size: Size, precision: Precision) -> aonet_scene::Result<Vec<PassCost>> {
    let plan = Plan::new(model.graph(), size)?;
    let pixels = size.pixels() as f64;
    let mut costs = Vec::new();
    if model.config().features.sees(Channel::DepthNormalized) {
        costs.push(cost("depth range", DEPTH_RANGE * pixels, DEPTH * pixels));
    }
    costs.extend(plan.steps.iter().map(|step| of_step(model, &plan, step, precision)));
    if plan.steps.iter().any(|step| matches!(step, Step::Head(_))) {
        let planes = |step: &Step| match step {
            Step::Head(HeadStep { planes, base, .. }) => Some([*planes, base.map_or(0, |_| *planes)]),
            _ => None,
        };
        let smooths = plan.steps.iter().any(|step| matches!(step, Step::Smooth { .. }));
        let of_pixel = if smooths { [1, 0] } else { plan.steps.iter().find_map(planes).unwrap_or([1, 0]) };
        let [values, base] = of_pixel.map(|n| n as f64 * VISIBILITY);
        costs.push(cost("image", IMAGE * pixels, (DEPTH + values + base + OUTPUT) * pixels));
    }
    Ok(costs)
}

/// The same of a classic method; none where it has no shaders.
pub fn classic_costs(method: &Classic, size: Size) -> Vec<PassCost> {
    let pixels = size.pixels() as f64;
    let mut costs = search(method, pixels);
    if costs.is_empty() {
        return costs;
    }
    costs.push(cost("image", IMAGE * pixels, (DEPTH + VISIBILITY + OUTPUT) * pixels));
    costs
}

/// A method and its filter.
fn search(method: &Classic, pixels: f64) -> Vec<PassCost> {
    let Some(SearchCost { search, filter_passes }) = search_cost(method) else { return vec![] };
    let mut costs = Vec::new();
    let mut coarser = 0.0;
    if parameter(method, "depth_levels") > 1.0 {
        coarser = DEPTH / 3.0;
        costs.push(cost("pyramid", PYRAMID * pixels, (DEPTH + coarser) * pixels));
    }
    if let Classic::Arcs(_) = method {
        costs.push(surfels(pixels));
    }
    costs.push(cost(method.name(), search * pixels, (NORMAL + DEPTH + coarser + VISIBILITY) * pixels));
    costs.resize(costs.len() + filter_passes, filter(pixels, 1));
    costs
}

fn of_step(model: &Model, plan: &Plan, step: &Step, precision: Precision) -> PassCost {
    let pixels = plan.size.pixels() as f64;
    let real = match precision {
        Precision::F32 => 4.0,
        Precision::F16 => 2.0,
    };
    let bytes = |id: BufferId| {
        let buffer = &plan.buffers[id];
        (buffer.channels * buffer.width * buffer.height) as f64 * real
    };
    let counted = ops::cost(model, plan, step);
    match step {
        Step::Surfels { .. } => surfels(pixels),
        Step::Search { search, .. } => {
            let found = search.planes() as f64 * VISIBILITY;
            cost(search.method().name(), counted.flop, (NORMAL + DEPTH + found) * pixels)
        }
        Step::Filter { search, .. } => filter(pixels, search.planes()),
        // Planes that the search found, as many of the network, and the image.
        Step::Smooth { search, .. } => {
            let planes = 2 * search.planes() + 1;
            cost("smooth", FILTER_FLOP * pixels, (NORMAL + DEPTH + planes as f64 * VISIBILITY) * pixels)
        }
        Step::Features { search, output, .. } => {
            let found = search.map_or(0.0, |found| plan.buffers[found].channels as f64 * VISIBILITY);
            cost("features", FEATURES * pixels, (NORMAL + DEPTH + found) * pixels + bytes(*output))
        }
        Step::Survey { output, .. } => {
            cost("survey", counted.flop, (NORMAL + DEPTH) * pixels + bytes(*output))
        }
        // Activations and weights; these are counted as f32.
        Step::Conv(ConvStep { name, .. }) => cost(name, counted.flop, counted.bytes * real / 4.0),
        Step::Head(HeadStep { name, input, guide, kernel, planes, neighbours, .. }) => {
            let guide = match kernel {
                KernelWeights::Off => 0.0,
                KernelWeights::Linear | KernelWeights::Softmax => bytes(*guide),
            };
            let weights = model.weights().get(&format!("{name}.weight")).values.len() as f64 * real;
            let raw = (plan.padded.pixels() * planes) as f64 * VISIBILITY;
            let found = if neighbours.is_empty() { 0.0 } else { VISIBILITY * pixels };
            cost("head", counted.flop, bytes(*input) + guide + weights + found + raw)
        }
        Step::Image { input } => {
            // The first of each block of four channels.
            let blocks = (plan.buffers[*input].width * plan.buffers[*input].height) as f64 * 4.0 * real;
            cost("image", IMAGE * pixels, blocks + (DEPTH + OUTPUT) * pixels)
        }
    }
}

/// Packing the normals of the one layer of timed frames.
fn surfels(pixels: f64) -> PassCost {
    cost("surfels", SURFELS * pixels, (NORMAL + DEPTH + SURFEL) * pixels)
}

/// One pass of the filter after a search that reports so many values for a pixel.
fn filter(pixels: f64, planes: usize) -> PassCost {
    cost("denoise", FILTER_FLOP * pixels, (NORMAL + DEPTH + 2.0 * planes as f64 * VISIBILITY) * pixels)
}

fn cost(pass: &str, flop: f64, bytes: f64) -> PassCost {
    PassCost { pass: pass.to_owned(), flop, bytes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::tests::model;
    use aonet::net::ModelConfig;

    #[test]
    fn convolutions_are_counted_as_the_graph_counts_them() {
        for config in [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_ao()] {
            let (model, size) = (model(config.clone()), Size::px(256, 128));
            let costs = network_costs(&model, size, Precision::F32).unwrap();
            let others =
                ["agtao", "denoise", "depth range", "features", "surfels", "survey", "smooth", "image"];
            let convs = costs.iter().filter(|c| !others.contains(&c.pass.as_str()));
            let found: f64 = convs.map(|c| c.flop).sum();
            let expected = 2.0 * model.graph().macs_per_pixel() * size.pixels() as f64;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected} {config:?}");
        }
    }

    #[test]
    fn costs_are_those_worked_out_by_hand() {
        let model = model(ModelConfig::paper());
        let of = |precision| {
            let costs = network_costs(&model, Size::px(64, 32), precision).unwrap();
            costs.into_iter().find(|c| c.pass == "dec0.conv0").unwrap()
        };
        let cells = 16 * 8;
        // The coarser 48 channels, the skip's 32, the output's 32; weights and biases.
        let values = (48 * cells / 4 + 32 * cells + 32 * cells + 9 * 80 * 32 + 32) as f64;
        assert_eq!((of(Precision::F32).bytes, of(Precision::F16).bytes), (4.0 * values, 2.0 * values));
        assert_eq!(of(Precision::F16).flop, (2 * 9 * 80 * 32 * cells) as f64);
        let gtao = classic_costs(&Classic::named("gtao").unwrap(), Size::px(60, 20));
        let bytes: Vec<_> = gtao.iter().map(|c| (c.pass.as_str(), c.bytes / 1200.0)).collect();
        let third = 4.0 / 3.0;
        let expected = [("pyramid", 4.0 + third), ("gtao", 16.0 + third), ("denoise", 20.0), ("image", 9.0)];
        assert!(bytes.iter().zip(expected).all(|(f, e)| f.0 == e.0 && (f.1 - e.1).abs() < 1e-9), "{bytes:?}");
    }
}
