//! Coarser depth for far taps. See `crate::search::pyramid`.

use crate::frame::size::Size;
use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::GtaoParams;
use std::f32::consts::SQRT_2;

/// Levels above the frame's own at most.
const COARSER: usize = 4;

/// Levels above the frame's own, one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pyramid {
    /// The struct `Levels` of `levels.wgsl`.
    levels: BufferId,
    coarse: BufferId,
    /// Of the frame.
    size: Size,
}

impl Pyramid {
    /// Adds memory for a frame of `size`.
    pub(crate) fn new(size: Size, list: &mut Dispatches) -> Self {
        let sizes =
            (1..=COARSER).map(|level| [size.width(), size.height()].map(|side| side.div_ceil(1 << level)));
        let (mut numbers, mut cells) = ([0; 2 * COARSER], 0);
        for (level, [width, height]) in sizes.enumerate() {
            (numbers[level], numbers[COARSER + level]) = (cells, width);
            cells += width * height;
        }
        let levels = list.uniform("pyramid levels", &numbers);
        let coarse = list.storage("pyramid", cells * size_of::<f32>());
        Self { levels, coarse, size }
    }

    /// What a search binds after its output.
    pub(crate) fn bindings(self) -> [Binding; 2] {
        [Binding::Uniform(self.levels), Binding::Read(self.coarse)]
    }

    /// Adds the dispatch that fills it, if there are coarser levels.
    pub(crate) fn push(self, surface: Surface, params: &GtaoParams, list: &mut Dispatches) {
        if coarser(params) == 0 {
            return;
        }
        let shader = shader(surface, params);
        let workgroups = [self.size.width().div_ceil(16), self.size.height().div_ceil(16), 1];
        let bindings = [Binding::Uniform(self.levels), Binding::Write(self.coarse)];
        list.push(&Dispatch { label: "pyramid", shader, sees_frame: true, workgroups }, &bindings);
    }
}

fn coarser(params: &GtaoParams) -> usize {
    (params.depth_levels as usize).saturating_sub(1).min(COARSER)
}

/// The shader that fills it.
pub(crate) fn shader(surface: Surface, params: &GtaoParams) -> Shader {
    surface
        .shader()
        .number("COARSER", coarser(params))
        // XeGTAO looks at three quarters of the radius when it builds the pyramid.
        .float("RANGE", 0.75 * params.radius_scale)
        .float("SOFT", params.falloff.max(1e-3))
        .part(include_str!("levels.wgsl"))
        .part(include_str!("pyramid.wgsl"))
}

/// A search that looks into it.
pub(crate) fn with_taps(search: Shader, params: &GtaoParams) -> Shader {
    search
        .number("COARSER", coarser(params))
        .float("INVERSE_NEAR", 1.0 / (params.depth_offset.exp2() * SQRT_2))
        .part(include_str!("levels.wgsl"))
        .part(include_str!("tap.wgsl"))
}
