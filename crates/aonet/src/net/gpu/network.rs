//! A model on a device: weights and shaders, which sessions of any size share.

use super::context::Context;
use super::conv::Conv;
use super::head::Head;
use super::options::Options;
use super::pass::Compiler;
use super::view;
use crate::error::{Error, Result};
use crate::net::config::Features;
use crate::net::graph::Graph;
use crate::net::model::Model;
use crate::net::plan::{BufferId, Plan, Step};

/// Sources of a convolution at most: with weights, bias and output they are within the eight storage buffers that
/// every device has.
const MAX_SOURCES: usize = 4;

/// A model on a device.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) context: Context,
    pub(super) options: Options,
    pub(super) features: Features,
    pub(super) graph: Graph,
    pub(super) compiler: Compiler,
    pub(super) steps: Vec<Weighed>,
}

/// A step of a plan with its weights.
#[derive(Debug)]
pub(super) enum Weighed {
    Features { output: BufferId, patch: usize },
    Conv(Conv),
    Head { head: Head, corrects: bool, patch: usize },
    Image { input: BufferId },
}

impl Network {
    /// # Errors
    /// When the device lacks something that the model needs.
    pub(super) fn new(
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

/// What the shaders need is what WebGPU promises; devices made for less are refused.
pub(super) fn check_limits(limits: &wgpu::Limits) -> Result<()> {
    let needed = wgpu::Limits::defaults();
    for (what, least, found) in [
        (
            "storage buffers of a shader",
            needed.max_storage_buffers_per_shader_stage,
            limits.max_storage_buffers_per_shader_stage,
        ),
        (
            "invocations of a workgroup",
            needed.max_compute_invocations_per_workgroup,
            limits.max_compute_invocations_per_workgroup,
        ),
        (
            "bytes of memory of a workgroup",
            needed.max_compute_workgroup_storage_size,
            limits.max_compute_workgroup_storage_size,
        ),
        (
            "workgroups of a dimension",
            needed.max_compute_workgroups_per_dimension,
            limits.max_compute_workgroups_per_dimension,
        ),
    ] {
        if found < least {
            return Err(Error::device(what, format!("at least {least}"), found));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_made_for_less_than_webgpu_promises_are_refused() {
        assert!(check_limits(&wgpu::Limits::defaults()).is_ok());
        let error = check_limits(&wgpu::Limits::downlevel_defaults()).unwrap_err().to_string();
        assert!(error.contains("storage buffers") && error.contains("at least 8"), "{error}");
    }
}
