//! The search before a network and the passes of its filter, over the arena. See [`crate::net::Op::Search`].

use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::SearchConfig;
use crate::net::plan::Buffer;
use crate::search;
use crate::simd::Isa;
use crate::threads::Workers;

/// The method without its filter.
#[derive(Debug)]
pub(super) struct Search {
    pub(super) search: SearchConfig,
    pub(super) output: Buffer,
}

impl Search {
    /// Runs over the arena.
    pub(super) fn run(
        &self,
        isa: Isa,
        frame: (&GBuffer, AoParams),
        (workers, arena): (&mut Workers, &mut [f32]),
    ) {
        let Buffer { width, .. } = self.output;
        workers.for_each_band(&mut arena[self.output.range()], width, |band| match self.search {
            SearchConfig::Agtao(params) => search::agtao_rows(isa, params, frame, (band.first, band.values)),
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
    pub(super) fn run(
        &self,
        isa: Isa,
        frame: (&GBuffer, AoParams),
        (workers, arena): (&mut Workers, &mut [f32]),
    ) {
        let ranges = [self.output.range(), self.input.range()];
        let [output, input] = arena.get_disjoint_mut(ranges).expect("live buffers do not overlap");
        let by = self.search.filter();
        workers.for_each_band(output, self.output.width, |band| {
            search::filter_rows(isa, by, frame, input, (band.first, band.values));
        });
    }
}
