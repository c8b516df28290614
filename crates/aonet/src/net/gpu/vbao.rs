//! Visibility bitmask. See [`crate::classic::vbao`].

use super::options::{Options, Precision};
use super::pixels::Reach;
use super::search;
use super::shader::Shader;
use crate::classic::VbaoParams;

/// The shader of the search.
pub(super) fn shader(of: (Precision, &Options), params: &VbaoParams) -> Shader {
    let VbaoParams { slices, steps, radius_scale, power, .. } = *params;
    search::shader(of, (slices, steps), Reach { radius_scale, power })
        .float("DISTRIBUTION", params.distribution)
        .float("THICKNESS", params.thickness)
        .flag("COSINE", params.cosine == 1)
        .part(include_str!("vbao.wgsl"))
}
