//! Connected arcs. See [`crate::search::arcs`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::ArcsParams;
use crate::search::arcs::MOST_GRAZING;
use crate::search::bent::BENT_SHARES;
use crate::search::gpu::pixels::{self, Reach};
use crate::search::gpu::{slices, surfels};
use crate::search::shares::{GAPS, PLANES, SHARES};
use crate::search::side::{CONNECTED, PARTS};
use crate::search::surfels::LENGTH;
use crate::search::vbao::SECTORS;

/// The shader of the search that writes so many planes: the visibility, [`PLANES`] with the shares, or [`BENT_SHARES`] with the bend as
/// well. It sees as many layers as the textures have.
pub(crate) fn shader(surface: Surface, params: &ArcsParams, planes: usize) -> Shader {
    let shader = with_arcs(pixels::of_planes(surface, reach(params), planes), surface, params);
    match planes {
        BENT_SHARES => shader
            .number("PART_COUNT", PARTS.len())
            .part(&format!("const PARTS = array<f32, {}>({});", PARTS.len(), floats(&PARTS)))
            .part(include_str!("beam.wgsl"))
            .part(include_str!("arcs_bent.wgsl")),
        _ => shader.part(include_str!("arcs_planes.wgsl")),
    }
}

/// A shader with `light_of` and `planes_of`, which return the light of a side and its visibility and shares, and without an entry point.
pub(crate) fn shares(surface: Surface, params: &ArcsParams) -> Shader {
    with_arcs(pixels::around(surface, reach(params), PLANES), surface, params)
}

fn reach(params: &ArcsParams) -> Reach {
    Reach { radius_scale: 1.0, power: params.power }
}

fn with_arcs(pixels: Shader, surface: Surface, params: &ArcsParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let ArcsParams { slices, steps, .. } = *params;
    let layers = surface.textures.layers;
    let shader = slices::with_slices(pixels, (slices, steps))
        .number("EARLIER", params.earlier_steps(layers.count()))
        .float("SECTORS", SECTORS)
        .float("CONNECTED", CONNECTED)
        .float("LEAST_FACING", MOST_GRAZING * LENGTH)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .number("SHARES", SHARES);
    surfels::with_normals(shader, layers)
        .part(&slices::distances(&params.spacing()))
        .part(&format!("const GAPS = array<f32, {}>({});", GAPS.len(), floats(&GAPS)))
        .part(&format!("const LOST = array<f32, {SHARES}>({});", floats(&params.lost())))
        .part(include_str!("sectors.wgsl"))
        .part(include_str!("arcs.wgsl"))
}

/// Numbers of an array.
fn floats(values: &[f32]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
}
