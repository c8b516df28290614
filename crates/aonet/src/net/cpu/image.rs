//! The first channel of a buffer as the image.

use super::context::Context;
use crate::frame::ao_image::AoImage;
use crate::frame::gbuffer::GBuffer;
use crate::net::plan::{Buffer, HALO};

/// The last step of a network whose last convolution is no head.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) input: Buffer,
}

impl Image {
    /// Runs over the arena into the image.
    pub(super) fn run(&self, context: Context<'_>, gbuffer: &GBuffer, image: &mut AoImage) {
        let Context { isa, workers, arena } = context;
        let input = &arena[self.input.range()];
        let (width, row_len) = (image.width(), self.input.row_len());
        let lanes = isa.lanes();
        workers.for_each_band(image.visibility_mut(), width, |band| {
            for (i, line) in band.values.chunks_exact_mut(width).enumerate() {
                let y = band.first + i;
                let pixels = input[y * row_len..][..row_len].chunks_exact(lanes).skip(HALO);
                let depth = &gbuffer.depth()[y * width..];
                for ((value, pixel), depth) in line.iter_mut().zip(pixels).zip(depth) {
                    *value = if *depth == f32::INFINITY { 1.0 } else { pixel[0].clamp(0.0, 1.0) };
                }
            }
        });
    }
}
