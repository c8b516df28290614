//! Coarser depth for far taps. See `crate::search::pyramid`.

use crate::error::Result;
use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::context::Context;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};
use crate::search::GtaoParams;
use std::f32::consts::SQRT_2;

/// Levels above the frame's own at most.
const COARSER: usize = 4;

/// Levels above the frame's own, one after the other.
#[derive(Debug)]
pub(crate) struct Pyramid {
    /// The struct `Levels` of `levels.wgsl`.
    levels: wgpu::Buffer,
    coarse: wgpu::Buffer,
}

impl Pyramid {
    /// Memory for a frame of `size` (width, height) [px].
    ///
    /// # Errors
    /// When it is more than a shader may see.
    pub(crate) fn new(context: &Context, size: (usize, usize)) -> Result<Self> {
        let sizes = (1..=COARSER).map(|level| [size.0, size.1].map(|side| side.div_ceil(1 << level)));
        let (mut numbers, mut cells) = ([0; 2 * COARSER], 0);
        for (level, [width, height]) in sizes.enumerate() {
            (numbers[level], numbers[COARSER + level]) = (cells, width);
            cells += width * height;
        }
        let levels = context.uniform("pyramid levels", &numbers)?;
        let coarse = context.storage("pyramid", cells * size_of::<f32>())?;
        Ok(Self { levels, coarse })
    }

    /// What a search binds after its output.
    pub(crate) fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::Uniform(&self.levels), Binding::Read(&self.coarse)]
    }

    /// The dispatch that fills it, if there are coarser levels.
    pub(crate) fn pass(
        &self,
        compiler: &Compiler,
        (of, params): ((Precision, &Options), &GtaoParams),
        (width, height): (usize, usize),
    ) -> Option<Pass> {
        let recipe = Recipe { label: "pyramid", shader: shader(of, params), sees_frame: true };
        let bindings = [Binding::Uniform(&self.levels), Binding::Write(&self.coarse)];
        let workgroups = [width.div_ceil(16), height.div_ceil(16), 1];
        (coarser(params) > 0).then(|| Pass::new(compiler, &recipe, &bindings, workgroups))
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.coarse.size()
    }
}

fn coarser(params: &GtaoParams) -> usize {
    (params.depth_levels as usize).saturating_sub(1).min(COARSER)
}

/// The shader that fills it.
pub(crate) fn shader(of: (Precision, &Options), params: &GtaoParams) -> Shader {
    surface(of.0, of.1)
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
