//! Attenuated GTAO: the horizon search that networks see and correct. See [`crate::search::agtao`].

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};
use crate::search::gpu::denoise;
use crate::search::gpu::pixels::{self, Reach};
use crate::search::gpu::slices;
use crate::search::{AgtaoParams, HORIZONS};

/// What the search finds, before and after the filter; HxW.
#[derive(Debug)]
pub(crate) struct Horizons {
    pub(crate) found: wgpu::Buffer,
    pub(crate) filtered: wgpu::Buffer,
}

/// The dispatches that fill both, if they are needed.
pub(crate) fn passes(
    of: (Precision, &Options),
    compiler: &Compiler,
    size: (usize, usize),
    horizons: Option<&Horizons>,
) -> Vec<Pass> {
    let Some(Horizons { found, filtered }) = horizons else { return vec![] };
    let search = Recipe { label: "agtao", shader: shader(of, &HORIZONS), sees_frame: true };
    vec![
        pixels::pass(compiler, &search, &[Binding::Write(found)], size),
        denoise::pass((compiler, denoise::shader(of, HORIZONS.denoise())), [found, filtered], size),
    ]
}

/// The shader of the search.
pub(crate) fn shader(of: (Precision, &Options), params: &AgtaoParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let AgtaoParams { slices, steps, radius_scale, power, .. } = *params;
    slices::shader(of, (slices, steps), Reach { radius_scale, power })
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
