//! A model on a device: weights and shaders, which sessions of any size share.

use crate::error::{Error, Result};
use crate::gpu::options::Options;
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::device::check_limits;
use crate::gpu::wgpu_30::pass::Compiler;
use crate::gpu::wgpu_30::view;
use crate::net::config::Features;
use crate::net::gpu::conv::Conv;
use crate::net::gpu::head::Head;
use crate::net::graph::Graph;
use crate::net::model::Model;
use crate::net::plan::{BufferId, Plan, Step};

/// Sources of a convolution at most: with weights, bias and output they are within the eight storage buffers that
/// every device has.
const MAX_SOURCES: usize = 4;

/// A model on a device.
#[derive(Debug)]
pub(crate) struct Network {
    pub(crate) context: Context,
    pub(crate) options: Options,
    pub(crate) features: Features,
    pub(crate) graph: Graph,
    pub(crate) compiler: Compiler,
    pub(crate) steps: Vec<Weighed>,
}

/// A step of a plan with its weights.
#[derive(Debug)]
pub(crate) enum Weighed {
    Features { output: BufferId, patch: usize },
    Conv(Conv),
    Head { head: Head, corrects: bool, patch: usize },
    Image { input: BufferId },
}

impl Network {
    /// # Errors
    /// When the device lacks something that the model needs.
    pub(crate) fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        model: &Model,
        options: Options,
    ) -> Result<Self> {
        check_limits(&device.limits())?;
        let features = model.config().features;
        let precision = options.precision.on(device, features);
        let context = Context {
            device: device.clone(),
            queue: queue.clone(),
            precision,
            kernels: options.kernels.on(device, precision),
        };
        // Its steps are those of every size.
        let plan = Plan::new(model.graph(), 1, 1)?;
        let steps = plan.steps.iter().map(|step| Weighed::new(step, &plan, model, &context));
        Ok(Self {
            steps: steps.collect::<Result<_>>()?,
            compiler: Compiler::new(device, view::layout(device)),
            context,
            options,
            features,
            graph: model.graph().clone(),
        })
    }
}

impl Weighed {
    fn new(step: &Step, plan: &Plan, model: &Model, context: &Context) -> Result<Self> {
        let weights = model.weights();
        Ok(match step {
            Step::Features { output, patch } => Self::Features { output: *output, patch: *patch },
            Step::Conv { name, sources, output, size, groups, activation } => {
                if sources.len() > MAX_SOURCES {
                    let expected = format!("at most {MAX_SOURCES} inputs side by side");
                    return Err(Error::config(name, expected, sources.len()));
                }
                let of = (name.as_str(), &sources[..], *output, [*size, *groups], *activation);
                Self::Conv(Conv::new(context, plan, weights, of)?)
            }
            Step::Head { name, input, guide, patch, kernel } => {
                let head = Head::new(context, plan, weights, (name, [*input, *guide], *patch, *kernel))?;
                let corrects = *kernel == crate::net::KernelWeights::Correction;
                Self::Head { head, corrects, patch: *patch }
            }
            Step::Image { input } => Self::Image { input: *input },
        })
    }
}
