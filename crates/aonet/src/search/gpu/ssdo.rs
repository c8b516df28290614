//! SSDO's occlusion. See [`crate::search::ssdo`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::SsdoParams;
use crate::search::gpu::hemisphere::{Sample, with_samples};
use crate::search::gpu::pixels::{self, Reach};

/// Its shader.
pub(crate) fn shader(surface: Surface, params: &SsdoParams) -> Shader {
    let SsdoParams { samples, radius_scale, power, .. } = *params;
    with_samples(pixels::shader(surface, Reach { radius_scale, power }), samples)
        .float("BIAS", params.bias)
        .float("DEPTH_LIMIT", params.depth_limit)
        .float("DISTRIBUTION", params.distribution)
        .part(include_str!("ssdo.wgsl"))
}

/// What it reads.
pub(crate) fn samples(params: &SsdoParams) -> Vec<Sample> {
    params.directions().into_iter().map(|([x, y, z], place)| [x, y, z, place]).collect()
}
