//! Attenuated GTAO. See [`crate::search::agtao`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::AgtaoParams;
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::slices;

/// The shader of the search.
pub(crate) fn shader(surface: Surface, params: &AgtaoParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let AgtaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(surface, (slices, steps), Reach { radius_scale, power })
        .float("ATTENUATION", params.attenuation)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(&shares(params))
        .part(include_str!("agtao.wgsl"))
}

/// Where the taps are: a cubic of the jitter for every step, as on the CPU.
fn shares(params: &AgtaoParams) -> String {
    let cubics: Vec<_> = (0..params.steps as usize)
        .map(|step| {
            let [c0, c1, c2, c3] = params.share(step).coefficients();
            format!("vec4({c0:?}, {c1:?}, {c2:?}, {c3:?})")
        })
        .collect();
    format!("const SHARES = array<vec4<f32>, STEPS>({});", cubics.join(", "))
}
