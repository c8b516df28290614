//! SSAO. See [`crate::classic::ssao`].

use super::hemisphere::{Sample, with_samples};
use super::options::{Options, Precision};
use super::pixels::{self, Reach};
use super::shader::Shader;
use crate::classic::SsaoParams;

/// Its shader.
pub(super) fn shader(of: (Precision, &Options), params: &SsaoParams) -> Shader {
    let SsaoParams { samples, radius_scale, power, .. } = *params;
    with_samples(pixels::shader(of, Reach { radius_scale, power }), samples)
        .flag("HEMISPHERE", params.hemisphere == 1)
        .float("BIAS", params.bias)
        .float("RANGE", params.range)
        .part(include_str!("ssao.wgsl"))
}

/// What it reads.
pub(super) fn samples(params: &SsaoParams) -> Vec<Sample> {
    params.points().into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()
}
