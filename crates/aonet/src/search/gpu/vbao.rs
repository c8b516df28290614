//! Visibility bitmask. See [`crate::search::vbao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::VbaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;
use crate::search::vbao::SECTORS;

/// The shader of the search.
pub(crate) fn shader(surface: Surface, params: &VbaoParams) -> Shader {
    let VbaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(surface, (slices, steps), Reach { radius_scale, power })
        .float("DISTRIBUTION", params.distribution)
        .float("THICKNESS", params.thickness)
        .float("SECTORS", SECTORS)
        .flag("COSINE", params.cosine == 1)
        .part(include_str!("sectors.wgsl"))
        .part(include_str!("vbao.wgsl"))
}
