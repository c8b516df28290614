//! Connected arcs. See [`crate::search::arcs`].

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::ArcsParams;
use crate::search::arcs::{CONNECTED, MOST_GRAZING, NEAR, earlier_steps};
use crate::search::gpu::pixels::Reach;
use crate::search::gpu::{slices, surfels};
use crate::search::surfels::LENGTH;
use crate::search::vbao::SECTORS;

/// The shader of the search. It sees as many layers as the textures have.
pub(crate) fn shader(surface: Surface, params: &ArcsParams) -> Shader {
    let (sin, cos) = params.angle_bias.to_radians().sin_cos();
    let ArcsParams { slices, steps, power, .. } = *params;
    let layers = surface.textures.layers;
    let shader = slices::bare(surface, (slices, steps), Reach { radius_scale: 1.0, power })
        .number("EARLIER", earlier_steps(layers.count()))
        .float("SECTORS", SECTORS)
        .float("CONNECTED", CONNECTED)
        .float("LEAST_FACING", MOST_GRAZING * LENGTH)
        .float("NEAR", NEAR)
        .float("COS_BIAS", cos)
        .float("SIN_BIAS", sin)
        .float("THICKNESS", params.thickness)
        .float("HIT", params.hit)
        .float("HIDDEN_NEAR", params.hidden_near)
        .float("HIDDEN_FAR", params.hidden_far);
    surfels::with_normals(shader, layers)
        .part(&slices::shares(steps, |step| params.share(step)))
        .part(include_str!("sectors.wgsl"))
        .part(include_str!("arcs.wgsl"))
}
