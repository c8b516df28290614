//! GTAO. See [`crate::classic::gtao`].

use super::options::{Options, Precision};
use super::pixels::Reach;
use super::pyramid;
use super::search;
use super::shader::Shader;
use crate::classic::GtaoParams;

/// The shader of the search; it reads a pyramid.
pub(super) fn shader(of: (Precision, &Options), params: &GtaoParams) -> Shader {
    let GtaoParams { slices, steps, radius_scale, power, .. } = *params;
    let shader = search::shader(of, (slices, steps), Reach { radius_scale, power })
        .float("DISTRIBUTION", params.distribution)
        .float("FALLOFF", params.falloff.max(1e-3))
        .float("THIN_OCCLUDER", params.thin_occluder);
    pyramid::with_taps(shader, params).part(include_str!("gtao.wgsl"))
}
