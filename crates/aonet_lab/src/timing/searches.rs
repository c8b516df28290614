//! Operations of the classic methods, counted by hand in their shaders; roots, logarithms and exponents count as one. The
//! CPU's code has the same ones.

use aonet::search::Classic;

/// Of a pixel of one pass of the filter: 25 neighbours.
pub(super) const FILTER_FLOP: f64 = 40.0 + 25.0 * 28.0;

/// Of a pixel around which a method looks: what it shows, noise, the exponent.
const AROUND: f64 = 120.0;

/// What a method does for a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SearchCost {
    /// Operations of the search, without pyramid and filter.
    pub(super) search: f64,
    /// Passes of the filter.
    pub(super) filter_passes: usize,
}

/// The cost of a method; none where it has no shaders.
pub(super) fn search_cost(method: &Classic) -> Option<SearchCost> {
    // Operations of a slice and of a tap.
    let (slice, tap) = match method {
        Classic::Ssao(_) => (0.0, 45.0),
        Classic::Ssdo(_) => (0.0, 48.0),
        Classic::Hbao(_) => (100.0, 55.0),
        Classic::Gtao(_) => (160.0, 60.0),
        Classic::Vbao(p) if p.cosine == 1 => (180.0, 200.0),
        Classic::Vbao(_) => (100.0, 85.0),
        Classic::Agtao(_) => (160.0, 80.0),
        Classic::Arcs(_) => (160.0, 360.0),
        Classic::Nnao(_) => return None,
    };
    let search = AROUND + parameter(method, "slices") * slice + f64::from(method.taps()) * tap;
    let settles = parameter(method, "denoise_keep") > 0.0;
    let filter_passes = parameter(method, "denoise_passes") as usize + usize::from(settles);
    Some(SearchCost { search, filter_passes })
}

/// A parameter of a method by name; 0 where it has none.
pub(super) fn parameter(method: &Classic, name: &str) -> f64 {
    method.parameters().iter().find(|k| k.name == name).map_or(0.0, |k| f64::from(k.value))
}
