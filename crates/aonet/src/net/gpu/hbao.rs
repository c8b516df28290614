//! HBAO. See [`crate::classic::hbao`].

use super::options::{Options, Precision};
use super::pixels::Reach;
use super::search;
use super::shader::Shader;
use crate::classic::HbaoParams;

/// Its shader.
pub(super) fn shader(of: (Precision, &Options), params: &HbaoParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let HbaoParams { slices, steps, radius_scale, power, .. } = *params;
    search::shader(of, (slices, steps), Reach { radius_scale, power })
        .float("ATTENUATION", params.attenuation)
        .float("DISTRIBUTION", params.distribution)
        .float("STRENGTH", params.strength)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(include_str!("hbao.wgsl"))
}
