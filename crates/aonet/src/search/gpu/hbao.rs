//! HBAO. See [`crate::search::hbao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::HbaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;

/// Its shader.
pub(crate) fn shader(surface: Surface, params: &HbaoParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let HbaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(surface, (slices, steps), Reach { radius_scale, power })
        .float("ATTENUATION", params.attenuation)
        .float("DISTRIBUTION", params.distribution)
        .float("STRENGTH", params.strength)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(include_str!("hbao.wgsl"))
}
