//! Attenuated GTAO. See [`crate::search::agtao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::AgtaoParams;
use crate::search::agtao::NEAR;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;

/// The shader of the search: it writes one plane, the visibility, or visibility and bend.
pub(crate) fn shader(surface: Surface, params: &AgtaoParams, planes: usize) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let AgtaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::with_horizons(surface, (slices, steps), Reach { radius_scale, power }, planes)
        .float("ATTENUATION", params.attenuation)
        .float("FOLLOW", params.follow)
        .float("NEAR", NEAR)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(&slices::distances(&params.spacing()))
        .part(include_str!("agtao.wgsl"))
}
