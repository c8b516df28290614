//! SSAO. See [`crate::search::ssao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::SsaoParams;
use crate::search::gpu::hemisphere::{Sample, with_samples};
use crate::search::gpu::pixels::{self, Reach};

/// Its shader.
pub(crate) fn shader(surface: Surface, params: &SsaoParams) -> Shader {
    let SsaoParams { samples, radius_scale, power, .. } = *params;
    with_samples(pixels::shader(surface, Reach { radius_scale, power }), samples)
        .flag("HEMISPHERE", params.hemisphere == 1)
        .float("BIAS", params.bias)
        .float("RANGE", params.range)
        .part(include_str!("ssao.wgsl"))
}

/// What it reads.
pub(crate) fn samples(params: &SsaoParams) -> Vec<Sample> {
    params.points().into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()
}
