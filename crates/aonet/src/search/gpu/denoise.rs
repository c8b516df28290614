//! The filter after a search. See `crate::search::denoise`.

use crate::gpu::image;
use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::denoise::{REACH, SPATIAL};
use crate::search::{Denoise, Pass};

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [16, 8];

/// Adds the dispatch that filters the first buffer into the second, both plane by plane.
pub(crate) fn push(shader: Shader, [found, filtered]: [BufferId; 2], list: &mut Dispatches) {
    let variants = vec![(shader, Grid::FRAME.workgroups(TILE, 1))];
    list.push(
        Dispatch { label: "denoise", sees_frame: true, variants },
        &[Binding::Write(filtered), Binding::Read(found)],
    );
}

/// Adds the dispatch that filters what a search found, `base`, and what a network makes of it, pixels of patches of `cells`, into a
/// visibility.
pub(crate) fn push_smoothing(
    shader: Shader,
    ([raw, base], cells): ([BufferId; 2], &Grid),
    smoothed: BufferId,
    list: &mut Dispatches,
) {
    let variants = vec![(shader, Grid::FRAME.workgroups(TILE, 1))];
    let cells = list.uniform("smooth", [cells.width.clone(), cells.height.clone()]);
    list.push(
        Dispatch { label: "smooth", sees_frame: true, variants },
        &[Binding::Write(smoothed), Binding::Read(raw), Binding::Read(base), Binding::Uniform(cells)],
    );
}

/// The shader of [`push`] for so many planes, of which the first is a visibility.
pub(crate) fn shader(surface: Surface, by: (Denoise, Pass), planes: usize) -> Shader {
    filter(surface, by, planes).part(include_str!("denoise_found.wgsl"))
}

/// The shader of [`push_smoothing`] for patches of this side (px); how many planes correct the search.
pub(crate) fn smoothing_shader(
    surface: Surface,
    by: (Denoise, Pass),
    (patch, planes): (usize, usize),
) -> Shader {
    let parts = if matches!(by.1, Pass::Correct { .. }) { 2 } else { 1 };
    filter(surface, by, parts)
        .number("PATCH", patch)
        .number("CORRECTION", planes)
        .part(&image::value_at(false))
        .part(include_str!("denoise_image.wgsl"))
}

/// The filter, without what it reads.
fn filter(surface: Surface, (by, pass): (Denoise, Pass), planes: usize) -> Shader {
    let ([s0, s1, s2], [first, others]) = (SPATIAL, pass.keeps());
    surface
        .shader()
        .tile(TILE)
        .number("REACH", REACH)
        .number("PLANES", planes)
        .part(&format!("const SPATIAL: vec3<f32> = vec3({s0:?}f, {s1:?}f, {s2:?}f);"))
        .float("PLANE", by.plane)
        .float("NORMAL", by.normal)
        .float("KEEP_FIRST", first)
        .float("KEEP_OTHERS", others)
        .part(include_str!("denoise.wgsl"))
}
