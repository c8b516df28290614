//! The horizon search that networks see and correct: attenuated GTAO and its filter. See [`crate::classic::agtao`].

use super::features::{Extras, surface};
use super::options::{Options, Precision};
use super::pass::{Binding, Compiler, Pass, Recipe};
use super::shader::Shader;
use crate::classic::HORIZONS;

/// What the search finds, before and after the filter; HxW.
#[derive(Debug)]
pub(super) struct Horizons {
    pub(super) found: wgpu::Buffer,
    pub(super) filtered: wgpu::Buffer,
}

/// The dispatches that fill both, if they are needed.
pub(super) fn passes(
    (precision, options): (Precision, &Options),
    compiler: &Compiler,
    (width, height): (usize, usize),
    extras: &Extras,
) -> Vec<Pass> {
    let Some(Horizons { found, filtered }) = &extras.horizons else { return vec![] };
    let search = Recipe { label: "agtao", shader: search_shader(precision, options), sees_frame: true };
    let filter = Recipe { label: "denoise", shader: filter_shader(precision, options), sees_frame: true };
    let tiles = |across: usize| [width.div_ceil(across), height.div_ceil(8), 1];
    vec![
        Pass::new(compiler, &search, &[Binding::Write(found)], tiles(8)),
        Pass::new(compiler, &filter, &[Binding::Write(filtered), Binding::Read(found)], tiles(16)),
    ]
}

/// The shader of the search.
pub(super) fn search_shader(precision: Precision, options: &Options) -> Shader {
    let (sin, cos) = HORIZONS.angle_bias.to_radians().sin_cos();
    surface(precision, options)
        .number("SLICES", HORIZONS.slices as usize)
        .number("STEPS", HORIZONS.steps as usize)
        .float("RADIUS_SCALE", HORIZONS.radius_scale)
        .float("ATTENUATION", HORIZONS.attenuation)
        .float("DISTRIBUTION", HORIZONS.distribution)
        .float("POWER", HORIZONS.power)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .part(include_str!("noise.wgsl"))
        .part(include_str!("slice.wgsl"))
        .part(include_str!("agtao.wgsl"))
}

/// The shader of the filter.
pub(super) fn filter_shader(precision: Precision, options: &Options) -> Shader {
    surface(precision, options)
        .float("PLANE", HORIZONS.denoise_plane)
        .float("NORMAL", HORIZONS.denoise_normal)
        .part(include_str!("denoise.wgsl"))
}
