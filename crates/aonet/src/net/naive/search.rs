//! Attenuated GTAO of a frame, pixel by pixel in f64.
//!
//! In a slice, a plane through the pixel and the viewer, the visible sky between the viewer and a horizon at an angle t gives the
//! light of Jimenez et al. 2016, Eq. 7. Where a tap raises the horizon, the light of that rise is lost, the less of it the
//! farther away the tap is.

use super::screen::Screen;
use super::{Planes, arcs, filter};
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::SearchConfig;
use crate::search::{AgtaoParams, noise_of};
use glam::DVec3;
use std::f64::consts::PI;

/// Least cosine between normal and view that the tangent plane is followed at.
const MOST_GRAZING: f64 = 0.1;
/// Least cosine between the projected normal and the viewer that the open sky is counted for.
const MOST_AVERTED: f64 = -0.25;

/// What a search finds, its filter included: the visibility, and the shares that it reports.
pub(super) fn search(config: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let screen = Screen::new(gbuffer, params);
    let mut found = match config {
        SearchConfig::Agtao(agtao) => Planes::from_fn((1, gbuffer.height(), gbuffer.width()), |_, y, x| {
            match gbuffer.is_foreground(y * gbuffer.width() + x) {
                true => screen.visibility(agtao, x, y) as f32,
                false => 1.0,
            }
        }),
        SearchConfig::Arcs(arcs) => arcs::planes(arcs, gbuffer, params),
    };
    for _ in 0..config.filter().passes {
        found = filter::filter(&screen, config.filter(), &found);
    }
    found
}

/// A plane through a pixel and the viewer.
pub(super) struct Slice {
    /// Direction on the screen, y up.
    pub(super) direction: [f64; 2],
    /// Unit vector in the slice, across the viewer.
    along: DVec3,
    /// How far a vector goes towards the viewer once it is moved into the slice along the tangent plane.
    towards: DVec3,
    /// Length of the normal's projection into the slice.
    pub(super) normal_length: f64,
    /// Angle of the projection from the viewer, positive along the slice (rad).
    normal_angle: f64,
}

impl Slice {
    pub(super) fn new(normal: DVec3, viewer: DVec3, angle: f64) -> Self {
        let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let along = (direction - viewer * direction.dot(viewer)).normalize();
        let axis = direction.cross(viewer).normalize();
        let facing = normal.dot(viewer);
        let slide = normal.dot(axis) / facing.max(MOST_GRAZING);
        let leaning = normal.dot(along);
        Self {
            direction: [direction.x, direction.y],
            along,
            towards: viewer + axis * slide,
            normal_length: facing.hypot(leaning).max(1e-6),
            normal_angle: leaning.atan2(facing),
        }
    }

    /// Light between the viewer and a horizon with this cosine on the side of `sign`.
    pub(super) fn light_above(&self, cosine: f64, sign: f64) -> f64 {
        let (t, n) = (cosine.clamp(-1.0, 1.0).acos(), sign * self.normal_angle);
        0.5 * (t.sin().powi(2) * n.cos() + (t - t.sin() * t.cos()) * n.sin())
    }

    /// Light of the slice when nothing occludes.
    fn open(&self) -> f64 {
        let n = self.normal_angle.cos().max(MOST_AVERTED).acos();
        n.cos() + n * n.sin()
    }

    /// Cosine between the viewer and a horizon so low that coarse meshes do not rise above it.
    pub(super) fn lowest(&self, bias: f64, sign: f64) -> f64 {
        let n = self.normal_angle;
        n.cos().max(0.0) * bias.sin() - sign * n.sin() * bias.cos()
    }
}

impl Screen<'_> {
    /// Visibility of a pixel before the filter.
    fn visibility(&self, params: &AgtaoParams, x: usize, y: usize) -> f64 {
        let (normal, viewer) = (self.normal(x, y), self.lens.to_viewer(x, y));
        let [turn, jitter] = noise_of(x, y).map(f64::from);
        let (mut lost, mut open) = (0.0, 0.0);
        for s in 0..params.slices {
            let angle = (turn + f64::from(s)) * PI / f64::from(params.slices);
            let slice = Slice::new(normal, viewer, angle);
            let jitter = (jitter + f64::from(s) * 0.618_034).fract();
            lost += slice.normal_length * self.lost(params, [x, y], &slice, jitter);
            open += slice.normal_length * slice.open();
        }
        (1.0 - lost / open.max(1e-6)).clamp(0.0, 1.0).powf(f64::from(params.power))
    }

    /// Light of a slice that occluders on both sides take.
    fn lost(&self, params: &AgtaoParams, pixel: [usize; 2], slice: &Slice, jitter: f64) -> f64 {
        let radius = self.radius * f64::from(params.radius_scale);
        let reach_px = self.lens.projected_px(radius, self.depth(pixel[0], pixel[1]));
        let bias = f64::from(params.angle_bias).to_radians();
        let mut horizons = [1.0, -1.0].map(|sign| (sign, slice.lowest(bias, sign)));
        let mut lost = 0.0;
        for step in 0..params.steps {
            let share = (jitter + f64::from(step)) / f64::from(params.steps);
            let pixels = (share.powf(f64::from(params.distribution)) * reach_px).max(1.0 + f64::from(step));
            for (sign, horizon) in &mut horizons {
                let Some(tap) = self.tap(pixel, slice, *sign * pixels) else { continue };
                let (towards, along) = (tap.dot(slice.towards), tap.dot(slice.along));
                let distance = towards.hypot(along);
                let cosine = towards / distance;
                if distance <= radius && cosine > *horizon {
                    let weight = 1.0 - f64::from(params.attenuation) * (distance / radius).powi(2);
                    let light = [*horizon, cosine].map(|cosine| slice.light_above(cosine, *sign));
                    lost += (light[0] - light[1]) * weight;
                    *horizon = cosine;
                }
            }
        }
        lost
    }

    /// The way from the pixel to the surface of a tap, which is the pixel nearest to a point of the slice that is `pixels` heights of a
    /// pixel away. None outside the frame and on the background.
    fn tap(&self, [x, y]: [usize; 2], slice: &Slice, pixels: f64) -> Option<DVec3> {
        let [right, up] = [slice.direction[0] * self.lens.columns_for_a_row(), slice.direction[1]]
            .map(|d| (d * pixels).round_ties_even());
        let (column, row) = (x as f64 + right, y as f64 - up);
        let (width, height) = (self.gbuffer.width() as f64, self.gbuffer.height() as f64);
        if !((0.0..width).contains(&column) && (0.0..height).contains(&row)) {
            return None;
        }
        let (column, row) = (column as usize, row as usize);
        let depth = self.depth(column, row);
        let from = self.lens.position(x, y, self.depth(x, y));
        depth.is_finite().then(|| self.lens.position(column, row, depth) - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_light_of_a_slice_is_its_integral() {
        let normal = DVec3::new(0.3, 0.2, 0.9).normalize();
        let slice = Slice::new(normal, DVec3::Z, 0.7);
        // Sum of cos(t - n) sin t over thin arcs.
        let sum = |end: f64, sign: f64| {
            let arcs = 10_000;
            let width = end / f64::from(arcs);
            let light = |i| {
                let t = (f64::from(i) + 0.5) * width;
                (t - sign * slice.normal_angle).cos() * t.sin() * width
            };
            (0..arcs).map(light).sum::<f64>()
        };
        for sign in [1.0, -1.0] {
            for end in [0.3, 1.0, FRAC_PI_2] {
                let off = slice.light_above(end.cos(), sign) - sum(end, sign);
                assert!(off.abs() < 1e-7, "{end} {sign}: {off}");
            }
            // The tangent plane is the horizon of an open sky.
            let tangent = slice.lowest(0.0, sign);
            assert!((tangent.acos() - (FRAC_PI_2 + sign * slice.normal_angle)).abs() < 1e-12);
        }
        let both: f64 = [1.0, -1.0].iter().map(|s| slice.light_above(slice.lowest(0.0, *s), *s)).sum();
        assert!((both - slice.open()).abs() < 1e-12, "{both} {}", slice.open());
    }
}
