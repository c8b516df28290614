//! Features of a frame, padded and partitioned into patches. See [`crate::net::Op::PatchPartition`].

use crate::error::Result;
use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};
use crate::net::config::{Channel, Features};
use crate::net::gpu::memory::{Memory, blocks};
use crate::net::plan::{BufferId, Plan};
use crate::search::gpu::agtao::Horizons;

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [16, 8];

/// What features need besides the textures.
#[derive(Debug)]
pub(crate) struct Extras {
    /// Bits of the range of depths; see `depth_range.wgsl`.
    pub(crate) depth_range: Option<wgpu::Buffer>,
    /// What a horizon search finds.
    pub(crate) horizons: Option<Horizons>,
}

/// The dispatch that finds the range of depths, if it is needed.
pub(crate) fn depth_range_pass(
    surface: Shader,
    compiler: &Compiler,
    (width, height): (usize, usize),
    extras: &Extras,
) -> Option<Pass> {
    let range = extras.depth_range.as_ref()?;
    let recipe = Recipe { label: "depth range", shader: depth_range_shader(surface), sees_frame: true };
    let workgroups = [width.div_ceil(16), height.div_ceil(16), 1];
    Some(Pass::new(compiler, &recipe, &[Binding::Write(range)], workgroups))
}

/// The dispatch that writes the features of the frame into `output`.
///
/// # Errors
/// Never for what [`Plan`] makes.
pub(crate) fn pass(
    (context, options, features): (&Context, &Options, Features),
    compiler: &Compiler,
    (plan, memory, extras): (&Plan, &Memory, &Extras),
    (output, patch): (BufferId, usize),
) -> Result<Pass> {
    let cells = &plan.buffers[output];
    let size = context.uniform("features", &[cells.width, cells.height])?;
    let mut bindings = vec![Binding::Uniform(&size), Binding::Write(memory.of(output))];
    bindings.extend(extras.depth_range.as_ref().map(Binding::Read));
    bindings.extend(extras.horizons.as_ref().map(|h| Binding::Read(&h.filtered)));
    let shader = shader((context.precision, options), features, patch);
    let recipe = Recipe { label: "features", shader, sees_frame: true };
    let quads = blocks(patch * patch);
    let workgroups = [cells.width.div_ceil(TILE[0]), cells.height.div_ceil(TILE[1]), quads];
    Ok(Pass::new(compiler, &recipe, &bindings, workgroups))
}

/// The shader of the features. Depth range and horizon follow the output, where there are such.
pub(crate) fn shader(of: (Precision, &Options), features: Features, patch: usize) -> Shader {
    let mut shader = surface(of.0, of.1)
        .number("PATCH", patch)
        .number("FEATURES", features.channels().len())
        .part(include_str!("features.wgsl"));
    let extras = [
        (Channel::DepthNormalized, "range: array<u32, 2>"),
        (Channel::HorizonOcclusion, "horizon: array<f32>"),
    ];
    let needed = extras.iter().filter(|(channel, _)| features.channels().contains(channel));
    for (i, (_, declaration)) in needed.enumerate() {
        shader = shader.part(&format!("@group(1) @binding({}) var<storage, read> {declaration};", i + 2));
    }
    shader.part(&features_of(features))
}

/// The shader of the depth range.
pub(crate) fn depth_range_shader(surface: Shader) -> Shader {
    surface.part(include_str!("depth_range.wgsl"))
}

/// The function that lists the features of a pixel.
fn features_of(features: Features) -> String {
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
        Channel::Normal(k) => format!("s.normal[{k}]"),
        Channel::NormalEncoded(k) => format!("select(0.0, 0.5 * s.normal[{k}] + 0.5, s.foreground)"),
        Channel::Position(k) => format!("select(0.0, position[{k}], s.foreground)"),
        Channel::Depth => "select(0.0, s.depth, s.foreground)".into(),
        Channel::DepthNormalized => {
            let near = "bitcast<f32>(~range[0])";
            let extent = format!("max(bitcast<f32>(range[1]) - {near}, {:?}f)", f32::MIN_POSITIVE);
            format!("select(1.0, (s.depth - {near}) / {extent}, s.foreground)")
        }
        Channel::ProjectedRadius => "projected_radius(s)".into(),
        Channel::HorizonOcclusion => "1.0 - horizon[pixel.y * frame.size.x + pixel.x]".into(),
    }
}
