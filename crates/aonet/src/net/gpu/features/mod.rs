//! Features of a frame, padded and partitioned into patches. See [`crate::net::graph::Op::PatchPartition`].

pub(crate) mod depth_range;

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::net::config::{Channel, Features};
use crate::net::features::{LOG2_PX_MEAN, LOG2_PX_RANGE, LOG2_PX_SCALE};
use crate::net::gpu::context::Context;
use crate::net::gpu::memory::blocks;
use crate::net::plan;

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [16, 8];

/// Where the features go, and what they need besides the textures.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target {
    /// The tensor that they are written into.
    pub(crate) output: plan::BufferId,
    /// Side of a patch (px).
    pub(crate) patch: usize,
    /// Bits of the range of depths; see `depth_range.wgsl`.
    pub(crate) depth_range: Option<BufferId>,
    /// What the search found, plane by plane, where channels show it.
    pub(crate) search: Option<BufferId>,
}

/// Adds the dispatch that writes the features of the frame.
pub(crate) fn push(features: &Features, target: Target, context: &Context<'_>, list: &mut Dispatches) {
    let Target { output, patch, depth_range, search } = target;
    let cells = context.grids.of(output);
    let size = list.uniform("features", [cells.width.clone(), cells.height.clone()]);
    let mut bindings = vec![Binding::Uniform(size), Binding::Write(context.memory.of(output))];
    bindings.extend(depth_range.map(Binding::Read));
    bindings.extend(search.map(Binding::Read));
    let quads = blocks(patch * patch);
    let dispatch = Dispatch {
        label: "features",
        sees_frame: true,
        variants: vec![(shader(context.surface, features, patch), cells.workgroups(TILE, quads))],
    };
    list.push(dispatch, &bindings);
}

/// The shader of the features. Depth range and search follow the output, where there are such.
pub(crate) fn shader(surface: Surface, features: &Features, patch: usize) -> Shader {
    let mut shader = surface
        .shader()
        .number("PATCH", patch)
        .number("FEATURES", features.channels().len())
        .tile(TILE)
        .float("LOG2_PX_LOW", LOG2_PX_RANGE.0)
        .float("LOG2_PX_HIGH", LOG2_PX_RANGE.1)
        .float("LOG2_PX_MEAN", LOG2_PX_MEAN)
        .float("LOG2_PX_SCALE", LOG2_PX_SCALE)
        .part(include_str!("features.wgsl"));
    let extras = [
        (features.sees(Channel::DepthNormalized), "range: array<u32, 2>"),
        (features.show_a_search(), "search: array<f32>"),
    ];
    let needed = extras.iter().filter(|(needed, _)| *needed);
    for (i, (_, declaration)) in needed.enumerate() {
        shader = shader.part(&format!("@group(1) @binding({}) var<storage, read> {declaration};", i + 2));
    }
    shader.part(&features_of(features))
}

/// The function that lists the features of a pixel.
fn features_of(features: &Features) -> String {
    let channels: Vec<_> =
        features.channels().iter().map(|c| format!("        {},\n", expression(*c))).collect();
    format!(
        "fn features_of(s: Surface, pixel: vec2<u32>) -> array<f32, FEATURES> {{\n    \
         let position = position_at(vec2<f32>(pixel), s.depth);\n    \
         return array<f32, FEATURES>(\n{}    );\n}}",
        channels.concat()
    )
}

/// See [`Channel`].
fn expression(channel: Channel) -> String {
    match channel {
        Channel::Normal(axis) => format!("s.normal[{}]", axis.index()),
        Channel::NormalEncoded(axis) => {
            format!("select(0.0, 0.5 * s.normal[{}] + 0.5, s.foreground)", axis.index())
        }
        Channel::Position(axis) => format!("select(0.0, position[{}], s.foreground)", axis.index()),
        Channel::Depth => "select(0.0, s.depth, s.foreground)".into(),
        Channel::DepthNormalized => {
            let near = "bitcast<f32>(~range[0])";
            let extent = format!("max(bitcast<f32>(range[1]) - {near}, {:?}f)", f32::MIN_POSITIVE);
            format!("select(1.0, (s.depth - {near}) / {extent}, s.foreground)")
        }
        Channel::ProjectedRadius => "projected_radius(s)".into(),
        Channel::HorizonOcclusion => "1.0 - search[pixel.y * frame.size.x + pixel.x]".into(),
        Channel::Light(share) => {
            let plane = share.search_plane();
            format!("search[({plane}u * frame.size.y + pixel.y) * frame.size.x + pixel.x]")
        }
        Channel::SecondLayer => "f32(LAYERS - 1u)".into(),
    }
}
