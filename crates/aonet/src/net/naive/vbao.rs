//! The visibility bitmask of a frame, pixel by pixel in f64, with sectors as plain booleans.
//!
//! A tap is the front of a slab of constant thickness along the view ray. It blocks the sectors of its slice between its front
//! and its back (Therrien et al. 2023). Every layer of the frame is such a slab.

use super::screen::Screen;
use super::search::Slice;
use super::{Planes, filter};
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::search::{VbaoParams, noise_of};
use std::f64::consts::{FRAC_PI_2, PI};

/// Sectors of a slice.
const SECTORS: usize = 32;

/// What the bitmask finds, its filter included: the visibility of every pixel, row by row; 1 on the background.
pub fn vbao(vbao: &VbaoParams, gbuffer: &GBuffer, params: AoParams) -> Vec<f32> {
    let screen = Screen::new(gbuffer, params);
    let mut found = Planes::from_fn((1, gbuffer.height(), gbuffer.width()), |_, y, x| {
        match gbuffer.is_foreground(y * gbuffer.width() + x) {
            true => screen.bitmask(vbao, [x, y]) as f32,
            false => 1.0,
        }
    });
    for pass in vbao.denoise().passes() {
        found = filter::filter(&screen, (vbao.denoise(), pass), &found);
    }
    found.values
}

impl Screen<'_> {
    fn bitmask(&self, params: &VbaoParams, [x, y]: [usize; 2]) -> f64 {
        let (normal, viewer) = (self.normal(x, y), self.lens.to_viewer(x, y));
        let [turn, jitter] = noise_of(x, y).map(f64::from);
        let (mut light, mut open) = (0.0, 0.0);
        for s in 0..params.slices {
            let slice = Slice::new(normal, viewer, (turn + f64::from(s)) * PI / f64::from(params.slices));
            let jitter = (jitter + f64::from(s) * 0.618_034).fract();
            let blocked = self.sectors(params, [x, y], &slice, jitter);
            let free = blocked.iter().filter(|blocked| !**blocked).count() as f64 / SECTORS as f64;
            let weight = if params.cosine == 1 { slice.normal_length * slice.open() } else { 1.0 };
            light += weight * free;
            open += weight;
        }
        (light / open.max(1e-6)).clamp(0.0, 1.0).powf(f64::from(params.power))
    }

    /// Which sectors of a slice the taps on both of its sides block.
    fn sectors(
        &self,
        params: &VbaoParams,
        [x, y]: [usize; 2],
        slice: &Slice,
        jitter: f64,
    ) -> [bool; SECTORS] {
        let radius = self.radius * f64::from(params.radius_scale);
        let thickness = self.radius * f64::from(params.thickness);
        let reach_px = self.lens.projected_px(radius, self.depth(x, y));
        let share = |angle: f64| match params.cosine {
            1 => slice.light_share(angle),
            _ => ((angle - slice.normal_angle) / PI + 0.5).clamp(0.0, 1.0),
        };
        let mut blocked = [false; SECTORS];
        for step in 0..params.steps {
            let along =
                ((jitter + f64::from(step)) / f64::from(params.steps)).powf(f64::from(params.distribution));
            let pixels = (along * reach_px).max(1.0 + f64::from(step));
            for sign in [1.0, -1.0] {
                for front in self.fronts([x, y], slice, sign * pixels).into_iter().flatten() {
                    let (towards, along) = (front.dot(slice.towards), front.dot(slice.along));
                    if towards.hypot(along) > radius {
                        continue;
                    }
                    let ends = [towards, towards - thickness].map(|t| sign * (t / t.hypot(along)).acos());
                    let [a, b] = ends.map(|angle| (share(angle) * SECTORS as f64).round_ties_even() as usize);
                    blocked[a.min(b)..a.max(b)].fill(true);
                }
            }
        }
        blocked
    }
}

impl Slice {
    /// Share of the slice's light on the negative side of an angle from the viewer.
    fn light_share(&self, angle: f64) -> f64 {
        let light = |angle: f64| angle.signum() * self.light_above(angle.cos(), angle.signum());
        let [low, high] = [-FRAC_PI_2, FRAC_PI_2].map(|side| self.normal_angle + side);
        let whole = (light(high) - light(low)).max(1e-6);
        ((light(angle.clamp(low, high)) - light(low)) / whole).clamp(0.0, 1.0)
    }
}
