//! HBAO. See [`crate::search::hbao`].

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::search::HbaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;

/// Its shader.
pub(crate) fn shader(of: (Precision, &Options), params: &HbaoParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let HbaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(of, (slices, steps), Reach { radius_scale, power })
        .float("ATTENUATION", params.attenuation)
        .float("DISTRIBUTION", params.distribution)
        .float("STRENGTH", params.strength)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(include_str!("hbao.wgsl"))
}
