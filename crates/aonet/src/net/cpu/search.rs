//! The search before a network and the passes of its filter, over the arena. See [`crate::net::graph::Op::Search`].

use super::context::Context;
use crate::frame::ao_image::AoImage;
use crate::net::config::SearchConfig;
use crate::net::plan::{Buffer, HALO};
use crate::search::survey::{Cells, survey_band};
use crate::search::{self, ArcsParams, BENT_PLANES, Screen};

/// Packs the normals of both layers.
#[derive(Debug)]
pub(super) struct Surfels {
    pub(super) outputs: [Buffer; 2],
}

impl Surfels {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let ranges = self.outputs.each_ref().map(Buffer::range);
        let layers = context.arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        search::surfels::pack((context.isa, context.workers), screen, layers);
    }
}

/// The method without its filter.
#[derive(Debug)]
pub(super) struct Search {
    pub(super) search: SearchConfig,
    /// Packed normals, if the method reads them.
    pub(super) surfels: Option<[Buffer; 2]>,
    pub(super) output: Buffer,
}

impl Search {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let Context { isa, workers, arena } = context;
        let [first, second] = self.surfels.as_ref().map_or([0..0, 0..0], |s| s.each_ref().map(Buffer::range));
        let [output, first, second] = arena
            .get_disjoint_mut([self.output.range(), first, second])
            .expect("live buffers do not overlap");
        let surfels = [&*first, &*second];
        workers.for_each_band(output, self.output.row_len(), |band| match self.search {
            SearchConfig::Agtao(params) if self.output.channels == BENT_PLANES => {
                search::bent_agtao_band(isa, params, screen, band);
            }
            SearchConfig::Agtao(params) => search::agtao_band(isa, params, screen, band),
            SearchConfig::Arcs(params) => search::arcs_band(isa, (params, surfels), screen, band),
        });
    }
}

/// Connected arcs from one pixel of every patch. See [`crate::net::graph::Op::Survey`].
#[derive(Debug)]
pub(super) struct Survey {
    pub(super) arcs: ArcsParams,
    /// Packed normals.
    pub(super) surfels: [Buffer; 2],
    /// Planar.
    pub(super) output: Buffer,
    /// Side (px).
    pub(super) patch: usize,
}

impl Survey {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let Context { isa, workers, arena } = context;
        let [first, second] = self.surfels.each_ref().map(Buffer::range);
        let [output, first, second] = arena
            .get_disjoint_mut([self.output.range(), first, second])
            .expect("live buffers do not overlap");
        let cells = Cells { origin: [0, 0], patch: self.patch, columns: self.output.width, halo: HALO };
        let (arcs, surfels) = (self.arcs, [&*first, &*second]);
        workers.for_each_band(output, self.output.row_len(), |band| {
            survey_band(isa, (arcs, surfels), screen, (cells, band));
        });
    }
}

/// One pass of the filter.
#[derive(Debug)]
pub(super) struct Filter {
    pub(super) search: SearchConfig,
    pub(super) input: Buffer,
    pub(super) output: Buffer,
}

impl Filter {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let Context { isa, workers, arena } = context;
        let ranges = [self.output.range(), self.input.range()];
        let [output, input] = arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        let filter = search::Filter::new(screen, self.search.filter(), input);
        workers.for_each_band(output, self.output.row_len(), |band| search::filter_band(isa, &filter, band));
    }
}

/// The filter over what a network added to what its search found.
#[derive(Debug)]
pub(super) struct Smooth {
    pub(super) search: SearchConfig,
    pub(super) base: Buffer,
    pub(super) added: Buffer,
}

impl Smooth {
    /// Runs over the image.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>, image: &mut AoImage) {
        let Context { isa, workers, arena } = context;
        let ranges = [self.added.range(), self.base.range()];
        let [added, base] = arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        let (width, stride) = (image.width(), self.base.row_len());
        let base: &[f32] = base;
        let visibility = image.visibility();
        workers.for_each_band(added, width, |band| {
            for (i, line) in band.values.chunks_exact_mut(width).enumerate() {
                let (y, found) = (band.first + i, &base[(band.first + i) * stride..]);
                let seen = &visibility[y * width..][..width];
                line.iter_mut().zip(seen).zip(found).for_each(|((added, v), found)| *added = v - found);
            }
        });
        let filter = search::Filter::new(screen, self.search.filter(), added);
        workers.for_each_band(image.visibility_mut(), width, |band| {
            search::smoothed_band(isa, &filter, (base, stride), band);
        });
    }
}
