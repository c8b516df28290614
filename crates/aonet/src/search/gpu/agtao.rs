//! Attenuated GTAO: the horizon search that networks see and correct. See [`crate::search::agtao`].

use crate::gpu::program::{Binding, BufferId, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::denoise;
use crate::search::gpu::pixels::{self, Reach};
use crate::search::gpu::slices;
use crate::search::{AgtaoParams, HORIZONS};

/// Adds the dispatches of the search that networks see; returns its filtered visibility, HxW.
pub(crate) fn push_horizons(surface: Surface, size: (usize, usize), list: &mut Dispatches) -> BufferId {
    let [found, filtered] = [(); 2].map(|()| pixels::visibility(list, "horizon visibility", size));
    pixels::push(("agtao", shader(surface, &HORIZONS)), &[Binding::Write(found)], size, list);
    denoise::push(denoise::shader(surface, HORIZONS.denoise()), [found, filtered], size, list);
    filtered
}

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
