//! Coarser depth for far taps. See `crate::search::pyramid`.

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches, Grid, Number};
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
}

impl Pyramid {
    /// Adds memory for a frame.
    pub(crate) fn new(list: &mut Dispatches) -> Self {
        let sizes = (1..=COARSER).map(|level| {
            let side = 1 << level;
            [Number::WIDTH.div_ceil(side), Number::HEIGHT.div_ceil(side)]
        });
        let (mut firsts, mut widths, mut cells) = (vec![], vec![], Number::from(0));
        for [width, height] in sizes {
            firsts.push(cells.clone());
            widths.push(width.clone());
            cells = cells + width * height;
        }
        let levels = list.uniform("pyramid levels", firsts.into_iter().chain(widths));
        let coarse = list.storage("pyramid", cells * size_of::<f32>().into());
        Self { levels, coarse }
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
        let variants = vec![(shader(surface, params), Grid::FRAME.workgroups([16, 16], 1))];
        let bindings = [Binding::Uniform(self.levels), Binding::Write(self.coarse)];
        list.push(Dispatch { label: "pyramid", sees_frame: true, variants }, &bindings);
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
