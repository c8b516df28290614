//! What the steps of a session are made from.

use super::packing::{Packing, Steps};
use super::precision::Arithmetic;
use super::ring::Input;
use crate::error::{Error, Result};
use crate::net::model::Ranges;
use crate::net::plan::{self, BufferId, Plan, Source, Step};
use crate::net::weights::Weights;

/// Parameters of a convolution.
#[derive(Clone, Copy)]
pub(super) struct Parameters<'a> {
    /// OIHW.
    pub(super) weight: &'a [f32],
    /// By output channel.
    pub(super) bias: &'a [f32],
}

/// A plan, its parameters, and the numbers that it multiplies.
pub(super) struct Recipe<'a> {
    pub(super) plan: &'a Plan,
    pub(super) weights: &'a Weights,
    pub(super) arithmetic: Arithmetic,
    /// Of the values that buffers hold; integers need them.
    pub(super) ranges: Option<&'a Ranges>,
}

impl<'a> Recipe<'a> {
    /// Parameters of the convolution `name`.
    pub(super) fn parameters(&self, name: &str) -> Parameters<'a> {
        let values = |what: &str| &self.weights.get(&format!("{name}.{what}")).values[..];
        Parameters { weight: values("weight"), bias: values("bias") }
    }

    /// What a convolution with `width` columns reads, packed for `arithmetic`.
    ///
    /// # Errors
    /// When there is not enough memory, or the ranges of integers are not known.
    pub(super) fn inputs(
        &self,
        sources: &[Source],
        width: usize,
        arithmetic: Arithmetic,
    ) -> Result<Vec<Input>> {
        let input = |source: &Source| {
            let packing =
                Packing { numbers: arithmetic.packed(), steps: self.steps(source.buffer, arithmetic)? };
            let buffer = self.plan.buffers[source.buffer].clone();
            Ok(Input::new(buffer, source.resample, width, packing))
        };
        sources.iter().map(input).collect()
    }

    /// The steps of a buffer's integers.
    ///
    /// # Errors
    /// As [`Recipe::inputs`].
    pub(super) fn steps(&self, buffer: BufferId, arithmetic: Arithmetic) -> Result<Steps> {
        let channels = self.plan.buffers[buffer].channels;
        if arithmetic.packed() < 4 {
            return Steps::none(channels);
        }
        let name = buffer_name(self.plan, buffer);
        let known = self.ranges.and_then(|ranges| ranges.get(name)).filter(|known| known.len() == channels);
        Steps::new(known.ok_or_else(|| {
            let expected = format!("the ranges of {channels} channels of {name}");
            Error::value("int8", expected, "a model that was not calibrated")
        })?)
    }
}

/// Name of a buffer in [`Ranges`]: its convolution's, `survey`, or `features`.
pub(super) fn buffer_name(plan: &Plan, buffer: BufferId) -> &str {
    let written = plan.steps.iter().find_map(|step| match step {
        Step::Conv(plan::ConvStep { name, output, .. }) if *output == buffer => Some(name.as_str()),
        Step::Conv(_)
        | Step::Surfels { .. }
        | Step::Search { .. }
        | Step::Filter { .. }
        | Step::Smooth { .. }
        | Step::Features { .. }
        | Step::Head(_)
        | Step::Image { .. } => None,
        Step::Survey { output, .. } => (*output == buffer).then_some("survey"),
    });
    written.unwrap_or("features")
}
