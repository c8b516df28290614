//! The parameters of NNAO, and what it sees of one pixel.

use super::params::filtered_params;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use glam::Vec3A;
use std::f32::consts::TAU;

/// Inputs of a tap: the difference of the normals, and of the depths over the radius.
pub const INPUTS: usize = 4;

filtered_params! {
    /// Parameters of NNAO.
    NnaoParams {
        /// Taps of the spiral. The published shader knows 8, 16 and 32; the weights were trained with 16.
        samples: u32 = 16 in 4..=64,
        /// Turns of the spiral.
        turns: f32 = 2.5 in 0.5..=20.0,
        /// Exponent on the visibility.
        power: f32 = 1.0 in 0.2..=4.0,
    }
}

/// The taps of a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Spiral<'a> {
    /// Number of taps and turns of the spiral.
    pub params: &'a NnaoParams,
    /// Rotation of the whole spiral (turns).
    pub rotation: f32,
}

impl Spiral<'_> {
    /// Place of tap `i` in the unit disk, y up.
    pub(crate) fn place(&self, i: u32) -> [f32; 2] {
        let Self { params, rotation } = *self;
        let share = (i as f32 + 0.5) / params.samples as f32;
        let (sin, cos) = (TAU * (rotation + share * params.turns)).sin_cos();
        [share * cos, share * sin]
    }
}

/// What the network sees at one tap of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NnaoTap {
    /// In the unit disk, y up.
    pub place: [f32; 2],
    /// 1 at the pixel, 0 at the radius and beyond.
    pub near: f32,
    /// Not standardised.
    pub inputs: [f32; INPUTS],
}

/// What the network sees of a pixel (x, y) of a frame. Taps outside the frame are left out.
pub fn taps(gbuffer: &GBuffer, ao: AoParams, spiral: Spiral<'_>, [x, y]: [usize; 2]) -> Vec<NnaoTap> {
    let (camera, width) = (gbuffer.camera(), gbuffer.width());
    let [focal_x, focal_y] = camera.focal_px();
    let depth = |x: usize, y: usize| gbuffer.depth()[y * width + x];
    let normal = |x: usize, y: usize| Vec3A::from(gbuffer.normal()[y * width + x]);
    let centre = camera.position_view(x, y, depth(x, y));
    let reach = camera.projected_px(ao.radius(), depth(x, y));
    let tap = |i: u32| {
        let place = spiral.place(i);
        let (sx, sy) = (
            (x as f32 + place[0] * reach * (focal_x / focal_y)).round(),
            (y as f32 - place[1] * reach).round(),
        );
        if sx < 0.0 || sy < 0.0 || sx >= width as f32 || sy >= gbuffer.height() as f32 {
            return None;
        }
        let (sx, sy) = (sx as usize, sy as usize);
        let d = depth(sx, sy);
        if !d.is_finite() {
            return Some(NnaoTap { place, near: 0.0, inputs: [0.0; INPUTS] });
        }
        let away = camera.position_view(sx, sy, d) - centre;
        let turn = normal(sx, sy) - normal(x, y);
        let near = (1.0 - away.length() / ao.radius()).clamp(0.0, 1.0);
        Some(NnaoTap { place, near, inputs: [turn.x, turn.y, turn.z, away.z / ao.radius()] })
    };
    (0..spiral.params.samples).filter_map(tap).collect()
}
