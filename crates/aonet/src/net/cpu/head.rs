//! The 1x1 convolution, the kernels that it predicts and the image that they give, cell by cell: the kernels
//! are applied while they are in registers. See [`crate::net::graph::Op::KernelPredict`]; AO-Net §3.3, Eq. 2.

use super::context::Context;
use super::dot::{Dot, DotKernel};
use super::guide_window::GuideWindow;
use super::head_weights::{HeadWeights, Order, VECTORS};
use super::kernel_predict::Tile;
use super::patch_head::PatchTile;
use super::patch_merge::{Base, Lines};
use super::precision::Arithmetic;
use super::recipe::Recipe;
use crate::error::Result;
use crate::frame::ao_image::AoImage;
use crate::frame::gbuffer::GBuffer;
use crate::net::plan::{Buffer, BufferId, HeadStep};
use crate::simd::Simd;
use crate::threads::Band;

/// The last step of a network.
#[derive(Debug)]
pub(super) struct Head {
    arithmetic: Arithmetic,
    weights: HeadWeights,
    guide: Buffer,
    /// Visibility that the outputs are added to, if there is any.
    base: Option<Buffer>,
}

impl Head {
    /// # Errors
    /// When there is not enough memory, or the ranges of integers are not known.
    pub(super) fn new(recipe: &Recipe<'_>, step: &HeadStep) -> Result<Self> {
        let buffer = |id: BufferId| recipe.plan.buffers[id].clone();
        let (guide, base) = (buffer(step.guide), step.base.map(buffer));
        Ok(Self { arithmetic: recipe.arithmetic, weights: HeadWeights::new(recipe, step)?, guide, base })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        match self.weights.order {
            Order::Cells => Tile::scratch_len(&self.weights, VECTORS * self.arithmetic.lanes()),
            Order::Pixels => PatchTile::scratch_len(&self.weights),
        }
    }

    /// Runs over the arena into the image.
    pub(super) fn run(&self, context: Context<'_>, gbuffer: &GBuffer, image: &mut AoImage) {
        match self.weights.order {
            Order::Cells => self.run_in::<false>(context, gbuffer, image),
            Order::Pixels => self.run_in::<true>(context, gbuffer, image),
        }
    }

    fn run_in<const PIXELS: bool>(&self, context: Context<'_>, gbuffer: &GBuffer, image: &mut AoImage) {
        let Context { workers, arena, .. } = context;
        let base = self.base.as_ref().map(|base| (&arena[base.range()], base.row_len()));
        let (input, guide) = (&arena[self.weights.input.range()], &arena[self.guide.range()]);
        let width = image.width();
        workers.for_each_band(image.visibility_mut(), width * self.weights.patch, |band| {
            self.arithmetic.run(HeadBand::<PIXELS> { head: self, input, guide, gbuffer, base, band });
        });
    }
}

/// Rows of cells. `PIXELS`: whether the order is [`Order::Pixels`]. Both orders in one function make it slower.
struct HeadBand<'a, const PIXELS: bool> {
    head: &'a Head,
    input: &'a [f32],
    guide: &'a [f32],
    gbuffer: &'a GBuffer<'a>,
    /// What the head corrects: the first plane of every row.
    base: Option<(&'a [f32], usize)>,
    band: Band<'a>,
}

impl<const PIXELS: bool> DotKernel for HeadBand<'_, PIXELS> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let Self { head: Head { weights, guide: buffer, .. }, band, .. } = self;
        let (width, patch) = (self.gbuffer.width(), weights.patch);
        let row_len = width * patch;
        let cells = width.div_ceil(patch);
        let depth = &self.gbuffer.depth()[band.first * row_len..];
        for (i, (image, depth)) in band.values.chunks_mut(row_len).zip(depth.chunks(row_len)).enumerate() {
            let y = band.first + i;
            let (planes, neighbours) = (weights.planes, &weights.neighbours[..]);
            let base = self.base.map(|(found, row_len)| Base {
                found,
                row_len,
                first: y * patch,
                planes,
                neighbours,
            });
            // With pixels side by side, a tile corrects what it computes.
            let mut lines = Lines { image, depth, base: if PIXELS { None } else { base }, width };
            let features = &self.input[y * weights.input.row_len()..][..weights.input.row_len()];
            if PIXELS {
                for first in PatchTile::firsts(cells) {
                    let tile = PatchTile { weights, features, base, width, first };
                    lines.write(&tile.run(dot, band.scratch));
                }
                continue;
            }
            for x in (0..cells).step_by(VECTORS * D::Simd::LANES) {
                let guide = GuideWindow { guide: self.guide, buffer, patch, y, x };
                let tile = Tile { weights, features, guide };
                let cells = match cells - x > D::Simd::LANES {
                    true => tile.run::<D, VECTORS>(dot, band.scratch),
                    false => tile.run::<D, 1>(dot, band.scratch),
                };
                lines.write(&cells);
            }
        }
    }
}
