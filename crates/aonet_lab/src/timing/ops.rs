//! The work of every step of a plan, and its time.

use super::searches::{FILTER_FLOP, search_cost};
use super::time_steps;
use aonet::Size;
use aonet::internals::kernel::TAPS;
use aonet::internals::neighbours;
use aonet::internals::plan::{Buffer, BufferId, ConvStep, HeadStep, Plan, Resample, Source, Step};
use aonet::net::cpu::Options;
use aonet::net::{KernelWeights, Model, SearchConfig};
use aonet::search::{ArcsParams, Classic};
use aonet_scene::Result;
use serde::Serialize;

/// Channels and bytes of a pixel of the G-buffer: normal and depth.
const GBUFFER_CHANNELS: usize = 4;
const GBUFFER_BYTES: usize = GBUFFER_CHANNELS * size_of::<f32>();

/// The work of a step on any runtime.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct OpCost {
    /// Prefix of its parameters, or the name of its result.
    pub name: String,
    /// Its operations, in order.
    pub kind: String,
    /// Channels that it reads.
    pub inputs: usize,
    /// Channels that it computes; of a head, those of its convolution.
    pub outputs: usize,
    /// Columns of the result (px or cells).
    pub width: usize,
    /// Rows of the result (px or cells).
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
    /// The work of the step.
    #[serde(flatten)]
    pub cost: OpCost,
    /// Median (ms).
    pub median_ms: f64,
}

/// Costs and times of all steps, measured as [`super::time`] does.
///
/// # Errors
/// As [`super::time`].
pub fn time_ops(model: &Model, size: Size, options: Options, runs: usize) -> Result<Vec<OpTime>> {
    let plan = Plan::new(model.graph(), size)?;
    let times = time_steps(model, size, options, runs)?;
    let with_time = |(step, median_ms)| OpTime { cost: cost(model, &plan, step), median_ms };
    Ok(plan.steps.iter().zip(times).map(with_time).collect())
}

/// The cost of a step of a plan.
pub(super) fn cost(model: &Model, plan: &Plan, step: &Step) -> OpCost {
    let counted = Counted { model, plan };
    match step {
        Step::Surfels { outputs } => counted.surfels(outputs),
        Step::Search { search, output, .. } => counted.search(search, *output),
        Step::Filter { input, output, .. } => counted.filter(*input, *output),
        Step::Smooth { base, read, .. } => counted.smooth(*base, *read),
        Step::Features { search, output, patch } => counted.features(*search, *output, *patch),
        Step::Survey { arcs, output, .. } => counted.survey(arcs, *output),
        Step::Conv(conv) => counted.conv(conv),
        Step::Head(head) => counted.head(head),
        Step::Image { input } => counted.image(*input),
    }
}

/// A plan whose steps are counted.
struct Counted<'a> {
    model: &'a Model,
    plan: &'a Plan,
}

impl Counted<'_> {
    fn surfels(&self, outputs: &[BufferId; 2]) -> OpCost {
        OpCost {
            name: "surfels".to_owned(),
            kind: "packed normals".to_owned(),
            inputs: GBUFFER_CHANNELS,
            bytes: (self.gbuffer_bytes() + outputs.iter().map(|id| self.bytes(*id)).sum::<usize>()) as f64,
            ..self.writes(outputs[0])
        }
    }

    fn search(&self, search: &SearchConfig, output: BufferId) -> OpCost {
        let method = search.method();
        let flop = search_cost(&method).map_or(0.0, |cost| cost.search);
        OpCost {
            name: "search".to_owned(),
            kind: format!("{}, {} taps", method.name(), method.taps()),
            inputs: GBUFFER_CHANNELS,
            flop: flop * self.pixels() as f64,
            bytes: (self.gbuffer_bytes() + self.bytes(output)) as f64,
            ..self.writes(output)
        }
    }

    fn filter(&self, input: BufferId, output: BufferId) -> OpCost {
        OpCost {
            name: "filter".to_owned(),
            kind: "5x5, by plane and normal".to_owned(),
            inputs: 1,
            flop: FILTER_FLOP * self.pixels() as f64,
            bytes: (self.gbuffer_bytes() + self.bytes(input) + self.bytes(output)) as f64,
            ..self.writes(output)
        }
    }

    fn smooth(&self, base: Option<BufferId>, read: BufferId) -> OpCost {
        // The image is read and written; what the filter reads is written before.
        let images = 2 * self.pixels() * size_of::<f32>() + 2 * self.bytes(read);
        OpCost {
            name: "smooth".to_owned(),
            kind: "5x5, by plane and normal".to_owned(),
            inputs: 1,
            outputs: 1,
            flop: FILTER_FLOP * self.pixels() as f64,
            bytes: (self.gbuffer_bytes() + base.map_or(0, |base| self.bytes(base)) + images) as f64,
            ..self.image_size()
        }
    }

    fn features(&self, search: Option<BufferId>, output: BufferId, patch: usize) -> OpCost {
        let found = search.map_or(0, |id| self.bytes(id));
        OpCost {
            name: "features".to_owned(),
            kind: format!("features, patches of {patch}"),
            inputs: self.model.config().features.channels().len(),
            bytes: (self.gbuffer_bytes() + found + self.bytes(output)) as f64,
            ..self.writes(output)
        }
    }

    fn survey(&self, arcs: &ArcsParams, output: BufferId) -> OpCost {
        let method = Classic::Arcs(*arcs);
        let flop = search_cost(&method).map_or(0.0, |cost| cost.search);
        let cells = self.plan.buffers[output].size().pixels();
        OpCost {
            name: "survey".to_owned(),
            kind: format!("{}, {} taps", method.name(), method.taps()),
            inputs: GBUFFER_CHANNELS,
            flop: flop * cells as f64,
            bytes: (self.gbuffer_bytes() + self.bytes(output)) as f64,
            ..self.writes(output)
        }
    }

    fn conv(&self, conv: &ConvStep) -> OpCost {
        let ConvStep { name, sources, output, size, groups, .. } = conv;
        let inputs: usize = sources.iter().map(|s| self.plan.buffers[s.buffer].channels).sum();
        let read: usize = sources.iter().map(|s| self.bytes(s.buffer)).sum();
        let out = &self.plan.buffers[*output];
        let macs = out.channels * inputs / groups * size * size * out.width * out.height;
        OpCost {
            name: name.clone(),
            kind: format!("{}conv {size}x{size}", before(sources)),
            inputs,
            flop: 2.0 * macs as f64,
            bytes: (read + self.bytes(*output) + self.parameter_bytes(name)) as f64,
            ..self.writes(*output)
        }
    }

    fn head(&self, head: &HeadStep) -> OpCost {
        let HeadStep { ref name, input, guide, kernel, ref neighbours, base, .. } = *head;
        let cells = &self.plan.buffers[input];
        let outputs = self.model.weights().get(&format!("{name}.bias")).values.len();
        let taps = match kernel {
            KernelWeights::Off => 0,
            KernelWeights::Linear | KernelWeights::Softmax => TAPS,
        };
        let weighed = taps + neighbours::count(neighbours);
        let macs = cells.channels * outputs * cells.width * cells.height + weighed * self.pixels();
        // The guide where kernels weigh it, the corrected visibility, depths for the background, the image.
        let bytes = self.bytes(input)
            + if taps > 0 { self.bytes(guide) } else { 0 }
            + base.map_or(0, |id| self.bytes(id))
            + 2 * self.pixels() * size_of::<f32>()
            + self.parameter_bytes(name);
        OpCost {
            name: name.clone(),
            kind: format!("conv 1x1, {}", after(kernel, base.is_some())),
            inputs: cells.channels,
            outputs,
            flop: 2.0 * macs as f64,
            bytes: bytes as f64,
            ..self.image_size()
        }
    }

    fn image(&self, input: BufferId) -> OpCost {
        let channels = self.plan.buffers[input].channels;
        OpCost {
            name: "image".to_owned(),
            kind: "clamp".to_owned(),
            inputs: channels,
            outputs: channels,
            bytes: (self.bytes(input) + 2 * self.pixels() * size_of::<f32>()) as f64,
            ..self.image_size()
        }
    }

    /// The size of a step that writes a buffer; no operations and no bytes.
    fn writes(&self, output: BufferId) -> OpCost {
        let Buffer { channels: outputs, width, height, .. } = self.plan.buffers[output];
        OpCost { outputs, width, height, ..OpCost::default() }
    }

    /// The size of a step that writes the image; no operations and no bytes.
    fn image_size(&self) -> OpCost {
        OpCost { width: self.plan.size.width(), height: self.plan.size.height(), ..OpCost::default() }
    }

    fn pixels(&self) -> usize {
        self.plan.size.pixels()
    }

    fn gbuffer_bytes(&self) -> usize {
        self.pixels() * GBUFFER_BYTES
    }

    fn bytes(&self, id: BufferId) -> usize {
        let buffer = &self.plan.buffers[id];
        buffer.channels * buffer.width * buffer.height * size_of::<f32>()
    }

    fn parameter_bytes(&self, name: &str) -> usize {
        let of = |part: &str| self.model.weights().get(&format!("{name}.{part}")).values.len();
        (of("weight") + of("bias")) * size_of::<f32>()
    }
}

/// How a convolution reads its inputs.
fn before(sources: &[Source]) -> String {
    let resampled = |s: &Source| match s.resample {
        Resample::None => String::new(),
        Resample::AvgPool(side) => format!("pool {side}, "),
        Resample::Upsample2 => "upsample, ".to_owned(),
    };
    let concat = if sources.len() > 1 { "concat, " } else { "" };
    sources.iter().map(resampled).collect::<String>() + concat
}

/// What happens to the sums of the head's convolution.
fn after(kernel: KernelWeights, corrects: bool) -> &'static str {
    match (kernel, corrects) {
        (KernelWeights::Off, false) => "merge",
        (KernelWeights::Off, true) => "correct",
        (KernelWeights::Linear, false) => "kernels",
        (KernelWeights::Linear, true) => "kernels, correct",
        (KernelWeights::Softmax, false) => "softmax kernels",
        (KernelWeights::Softmax, true) => "softmax kernels, correct",
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::model;
    use super::*;
    use aonet::net::ModelConfig;

    fn costs(config: ModelConfig, size: Size) -> (Model, Vec<OpCost>) {
        let model = model(config);
        let plan = Plan::new(model.graph(), size).unwrap();
        let costs = plan.steps.iter().map(|step| cost(&model, &plan, step)).collect();
        (model, costs)
    }

    #[test]
    fn operations_add_up_to_what_the_graph_counts() {
        let networks = [
            ModelConfig::paper(),
            ModelConfig::balanced(),
            ModelConfig::deep_shading(),
            ModelConfig::deep_ao(),
            ModelConfig::full_resolution(),
        ];
        for config in networks {
            // A size that every network takes without padding.
            let size = Size::px(256, 128);
            let (model, costs) = costs(config.clone(), size);
            let searches = ["search", "filter", "surfels", "survey", "smooth"];
            let network = costs.iter().filter(|c| !searches.contains(&c.name.as_str()));
            let found: f64 = network.map(|c| c.flop).sum();
            let expected = 2.0 * model.graph().macs_per_pixel() * size.pixels() as f64;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected} {config:?}");
        }
    }

    #[test]
    fn costs_are_those_worked_out_by_hand() {
        let (_, costs) = costs(ModelConfig::paper(), Size::px(64, 32));
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
        let (_, costs) = costs(ModelConfig::correcting(), Size::px(64, 64));
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

    #[test]
    fn smoothing_is_counted_as_a_filter() {
        let (_, costs) = costs(ModelConfig::balanced(), Size::px(64, 64));
        let (filter, smooth) = (&costs[1], costs.last().unwrap());
        assert_eq!((filter.name.as_str(), smooth.name.as_str()), ("filter", "smooth"));
        assert_eq!(filter.flop, smooth.flop);
        // Normal and depth; what was found; the image read and written, its copy written and read.
        assert_eq!(smooth.bytes / (64.0 * 64.0), 16.0 + 4.0 + 8.0 + 8.0);
    }

    #[test]
    fn a_survey_is_counted_at_the_resolution_of_patches() {
        let (_, costs) = costs(ModelConfig::balanced(), Size::px(64, 64));
        let survey = costs.iter().find(|cost| cost.name == "survey").expect("a survey");
        assert_eq!((survey.kind.as_str(), survey.outputs), ("arcs, 64 taps", 6));
        assert_eq!((survey.width, survey.height), (16, 16));
        let whole = search_cost(&ModelConfig::balanced().survey.map(Classic::Arcs).unwrap()).unwrap().search;
        assert_eq!(survey.flop, whole * 256.0);
    }
}
