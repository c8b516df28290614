//! The search before a network and the passes of its filter, over the arena. See [`crate::net::graph::Op::Search`].

use super::context::Context;
use crate::frame::ao_image::AoImage;
use crate::net::config::SearchConfig;
use crate::net::plan::{Buffer, HALO};
use crate::search::survey::{Cells, survey_band};
use crate::search::{self, ArcsParams, BENT_PLANES, BENT_SHARES, Pass, Screen};

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
            SearchConfig::Arcs(params) if self.output.channels == BENT_SHARES => {
                search::bent_arcs_band(isa, (params, surfels), screen, band);
            }
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
    pub(super) pass: Pass,
    pub(super) input: Buffer,
    pub(super) output: Buffer,
}

impl Filter {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let Context { isa, workers, arena } = context;
        let ranges = [self.output.range(), self.input.range()];
        let [output, input] = arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        let filter =
            search::Filter::new(screen, self.search.filter(), self.pass, search::Input::Planes(input));
        workers.for_each_band(output, self.output.row_len(), |band| filter.run(isa, band.first, band.values));
    }
}

/// The filter over a network's image. See [`Step::Smooth`](crate::net::plan::Step::Smooth).
#[derive(Debug)]
pub(super) struct Smooth {
    pub(super) search: SearchConfig,
    pub(super) pass: Pass,
    pub(super) base: Option<Buffer>,
    pub(super) read: Buffer,
}

impl Smooth {
    /// Runs over the image.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>, image: &mut AoImage) {
        let Context { isa, workers, arena } = context;
        let ranges = [self.read.range(), self.base.as_ref().map_or(0..0, Buffer::range)];
        let [read, base] = arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        let (width, visibility) = (image.width(), image.visibility());
        workers.for_each_band(read, width, |band| {
            band.values.copy_from_slice(&visibility[band.first * width..][..band.values.len()]);
        });
        let input = match self.base {
            None => search::Input::Planes(read),
            Some(_) => search::Input::Corrected { found: base, image: read },
        };
        let filter = search::Filter::new(screen, self.search.filter(), self.pass, input);
        workers.for_each_band(image.visibility_mut(), width, |band| {
            filter.run(isa, band.first, band.values);
        });
    }
}
