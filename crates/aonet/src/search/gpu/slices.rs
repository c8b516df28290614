//! What the methods that look for occluders in slices share.

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::bent::BENT_PLANES;
use crate::search::cubic::Spacing;
use crate::search::gpu::pixels::{self, Reach};
use crate::search::slice::MOST_GRAZING;

/// A shader without the method's own part: so many slices and taps on each side of them.
pub(crate) fn shader(surface: Surface, cost: (u32, u32), reach: Reach) -> Shader {
    with_slices(pixels::shader(surface, reach), cost)
        .part(include_str!("slices.wgsl"))
        .part(include_str!("gather.wgsl"))
}

/// The same for a method with horizons, which adds `lost_in`: it writes visibility, or visibility and bend.
pub(crate) fn with_horizons(surface: Surface, cost: (u32, u32), reach: Reach, planes: usize) -> Shader {
    match planes {
        BENT_PLANES => with_slices(pixels::of_planes(surface, reach, planes), cost)
            .part(include_str!("slices.wgsl"))
            .part(include_str!("beam.wgsl"))
            .part(include_str!("bent.wgsl")),
        _ => shader(surface, cost, reach).part(include_str!("horizons.wgsl")),
    }
}

/// A shader of pixels that looks along slices: so many of them, and so many taps on each side.
pub(crate) fn with_slices(pixels: Shader, (slices, steps): (u32, u32)) -> Shader {
    pixels
        .number("SLICES", slices as usize)
        .number("STEPS", steps as usize)
        .float("MOST_GRAZING", MOST_GRAZING)
        .part(include_str!("slice.wgsl"))
}

/// Where the taps are: a cubic of the jitter for every step, as on the CPU.
pub(crate) fn distances(spacing: &Spacing) -> String {
    let cubics: Vec<_> = spacing
        .steps()
        .iter()
        .map(|step| {
            let [c0, c1, c2, c3] = step.coefficients();
            format!("vec4({c0:?}, {c1:?}, {c2:?}, {c3:?})")
        })
        .collect();
    format!("const DISTANCES = array<vec4<f32>, STEPS>({});", cubics.join(", "))
}
