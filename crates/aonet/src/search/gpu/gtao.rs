//! GTAO. See [`crate::search::gtao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::GtaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::pyramid;
use crate::search::gpu::slices;

/// The shader of the search; it reads a pyramid, and writes one plane, the visibility, or visibility and bend.
pub(crate) fn shader(surface: Surface, params: &GtaoParams, planes: usize) -> Shader {
    let GtaoParams { slices, steps, radius_scale, power, .. } = *params;
    let shader = slices::with_horizons(surface, (slices, steps), Reach { radius_scale, power }, planes)
        .float("DISTRIBUTION", params.distribution)
        .float("FALLOFF", params.falloff.max(1e-3))
        .float("THIN_OCCLUDER", params.thin_occluder);
    pyramid::with_taps(shader, params).part(include_str!("gtao.wgsl"))
}
