//! The AO texture: a render pass, because few formats of one channel can be written by other shaders.

use crate::gpu::program::{Binding, BufferId, Dispatches, Draw, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::denoise;
use crate::search::{Denoise, Pass};

/// What the image is made of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Raw {
    /// One value a pixel, pixel of the patch by pixel.
    Pixels(BufferId),
    /// The first channel of blocks of four.
    FirstChannel(BufferId),
}

/// The last pass of a program.
#[derive(Debug, Clone)]
pub(crate) struct Image {
    pub(crate) raw: Raw,
    /// Side of a patch (px).
    pub(crate) patch: usize,
    /// Columns and rows of patches.
    pub(crate) cells: Grid,
    /// What a search found, plane by plane, and how many planes of values correct it.
    pub(crate) base: Option<(BufferId, usize)>,
}

impl Image {
    /// The same after the filter.
    pub(crate) fn smoothed(self, by: (Denoise, Pass), surface: Surface, list: &mut Dispatches) -> Self {
        let (Raw::Pixels(raw), Some((base, planes))) = (self.raw, self.base) else {
            unreachable!("a head corrects a search")
        };
        let smoothed = list.storage("smoothed", Grid::FRAME.count() * size_of::<f32>().into());
        let shader = denoise::smoothing_shader(surface, by, (self.patch, planes));
        denoise::push_smoothing(shader, ([raw, base], &self.cells), smoothed, list);
        Self { raw: Raw::Pixels(smoothed), patch: 1, cells: Grid::FRAME, base: None }
    }

    /// Adds what the draw needs to the list.
    pub(crate) fn draw(self, surface: Surface, list: &mut Dispatches) -> Draw {
        let (Raw::Pixels(raw) | Raw::FirstChannel(raw)) = self.raw;
        let blocked = matches!(self.raw, Raw::FirstChannel(_));
        let shader = shader(surface, (self.patch, self.base.map_or(0, |(_, planes)| planes)), blocked);
        let cells = list.uniform("image", [self.cells.width, self.cells.height]);
        // Without a base something has to be bound in its place.
        let base = self.base.map_or(raw, |(base, _)| base);
        let bindings = vec![Binding::Uniform(cells), Binding::Read(raw), Binding::Read(base)];
        Draw { shader: list.shader(&covering(shader.source())), bindings }
    }
}

/// The shader of the image; how many planes correct a search, and whether it reads blocks of four channels.
pub(crate) fn shader(surface: Surface, (patch, planes): (usize, usize), blocked: bool) -> Shader {
    let ty = if blocked { "real4" } else { "f32" };
    surface
        .shader()
        .number("PATCH", patch)
        .number("CORRECTION", planes)
        .part(&include_str!("image.wgsl").replace("RAW", ty))
        .part(&value_at(blocked))
}

/// The function that computes the visibility of a pixel from `raw` and `base`; whether `raw` holds blocks of four channels.
pub(crate) fn value_at(blocked: bool) -> String {
    include_str!("image_value.wgsl").replace("FIRST_CHANNEL", if blocked { ".x" } else { "" })
}

/// A source with the vertex stage `cover` of a triangle that covers the target.
pub(crate) fn covering(source: &str) -> String {
    // Behind the source, which may begin with what has to come first.
    format!("{source}\n{}", include_str!("cover.wgsl"))
}
