//! Connected arcs from one pixel of every patch. See [`crate::net::graph::Op::Survey`].

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::net::gpu::context::Context;
use crate::net::gpu::memory::blocks;
use crate::net::plan;
use crate::search::ArcsParams;
use crate::search::gpu::{arcs, pixels, surfels};
use crate::search::survey::SURVEYED;

/// Invocations of a pixel at most: with the pixels of a workgroup, as many as every device has.
const MOST_SIDES: usize = 4;

/// Adds the dispatch; it reads the packed normals of every layer.
pub(crate) fn push(
    params: &ArcsParams,
    (packed, output): ([BufferId; 2], plan::BufferId),
    patch: usize,
    (context, list): (&Context<'_>, &mut Dispatches),
) {
    let surface = context.surface;
    let mut bindings = vec![Binding::Write(context.memory.of(output))];
    bindings.extend(surfels::read(&packed, surface));
    let shader = shader(surface, params, [patch, context.plan.padded.width()]);
    let variants = vec![(shader, context.grids.of(output).workgroups(pixels::TILE, 1))];
    list.push(Dispatch { label: "survey", sees_frame: true, variants }, &bindings);
}

/// Invocations of a pixel, each for as many sides of slices.
fn sides(params: &ArcsParams) -> usize {
    let sides = 2 * params.slices as usize;
    (1..=MOST_SIDES).rev().find(|share| sides.is_multiple_of(*share)).expect("1 divides every number")
}

/// Its shader, for patches of this side in frames that are padded to multiples of the alignment (px).
pub(crate) fn shader(surface: Surface, params: &ArcsParams, [patch, alignment]: [usize; 2]) -> Shader {
    arcs::shares(surface, params)
        .number("PATCH", patch)
        .number("SIDES", sides(params))
        .number("ALIGNMENT", alignment)
        .number("BLOCKS", blocks(SURVEYED))
        .part(include_str!("survey.wgsl"))
}
