//! The search before a network and the passes of its filter, over the arena. See [`crate::net::graph::Op::Search`].

use super::context::Context;
use crate::net::config::SearchConfig;
use crate::net::plan::Buffer;
use crate::search::{self, Screen};

/// The method without its filter.
#[derive(Debug)]
pub(super) struct Search {
    pub(super) search: SearchConfig,
    pub(super) output: Buffer,
}

impl Search {
    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, screen: &Screen<'_>) {
        let (Context { isa, workers, arena }, width) = (context, self.output.width);
        workers.for_each_band(&mut arena[self.output.range()], width, |band| match self.search {
            SearchConfig::Agtao(params) => search::agtao_band(isa, params, screen, band),
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
        workers.for_each_band(output, self.output.width, |band| search::filter_band(isa, &filter, band));
    }
}
