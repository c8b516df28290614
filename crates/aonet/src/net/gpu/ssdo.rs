//! SSDO's occlusion. See [`crate::classic::ssdo`].

use super::hemisphere::{Sample, with_samples};
use super::options::{Options, Precision};
use super::pixels::{self, Reach};
use super::shader::Shader;
use crate::classic::SsdoParams;

/// Its shader.
pub(super) fn shader(of: (Precision, &Options), params: &SsdoParams) -> Shader {
    let SsdoParams { samples, radius_scale, power, .. } = *params;
    with_samples(pixels::shader(of, Reach { radius_scale, power }), samples)
        .float("BIAS", params.bias)
        .float("DEPTH_LIMIT", params.depth_limit)
        .float("DISTRIBUTION", params.distribution)
        .part(include_str!("ssdo.wgsl"))
}

/// What it reads.
pub(super) fn samples(params: &SsdoParams) -> Vec<Sample> {
    params.directions().into_iter().map(|([x, y, z], place)| [x, y, z, place]).collect()
}
