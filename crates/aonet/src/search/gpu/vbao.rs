//! Visibility bitmask. See [`crate::search::vbao`].

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::search::VbaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;

/// The shader of the search.
pub(crate) fn shader(of: (Precision, &Options), params: &VbaoParams) -> Shader {
    let VbaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(of, (slices, steps), Reach { radius_scale, power })
        .float("DISTRIBUTION", params.distribution)
        .float("THICKNESS", params.thickness)
        .flag("COSINE", params.cosine == 1)
        .part(include_str!("vbao.wgsl"))
}
