//! Which values the inputs of convolutions take, for integers that cover them.

use super::recipe::buffer_name;
use super::session::Session;
use crate::error::Result;
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::gbuffer::GBuffer;
use crate::net::model::Ranges;
use crate::net::plan::{Buffer, ConvStep, HALO, Layout, Plan, Step};

impl Session {
    /// [`Session::run`] that widens `ranges` by what the convolutions of this frame read. For sessions in f32: others
    /// would measure what they rounded.
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn calibrate(
        &mut self,
        gbuffer: &GBuffer,
        params: AoParams,
        image: &mut AoImage,
        ranges: &mut Ranges,
    ) -> Result<()> {
        let lanes = self.lanes();
        self.run_steps(gbuffer, params, image, &mut |i, plan, arena| {
            if let Some(id) = written_by(plan, i) {
                let buffer = &plan.buffers[id];
                let known = ranges.entry(buffer_name(plan, id).to_owned()).or_default();
                known.resize(buffer.channels, [f32::INFINITY, f32::NEG_INFINITY]);
                widen(known, buffer, &arena[buffer.range()], lanes);
            }
        })
    }
}

/// The buffer that a step writes for convolutions to read.
fn written_by(plan: &Plan, step: usize) -> Option<usize> {
    match &plan.steps[step] {
        Step::Features { output, .. } | Step::Survey { output, .. } | Step::Conv(ConvStep { output, .. }) => {
            Some(*output)
        }
        Step::Surfels { .. }
        | Step::Search { .. }
        | Step::Filter { .. }
        | Step::Smooth { .. }
        | Step::Head(_)
        | Step::Image { .. } => None,
    }
}

fn widen(ranges: &mut [[f32; 2]], buffer: &Buffer, values: &[f32], lanes: usize) {
    let pixels = buffer.width + 2 * HALO;
    for row in values.chunks_exact(buffer.row_len()) {
        for (c, [least, greatest]) in ranges.iter_mut().enumerate() {
            let (first, step) = match buffer.layout {
                Layout::Planar => (c * pixels, 1),
                Layout::Blocked => (c / lanes * pixels * lanes + c % lanes, lanes),
                Layout::Image => unreachable!("convolutions do not read images"),
            };
            for value in row[first..].iter().step_by(step).take(pixels) {
                (*least, *greatest) = (least.min(*value), greatest.max(*value));
            }
        }
    }
}
