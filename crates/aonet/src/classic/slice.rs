//! A plane through a pixel and the camera, in which the methods with horizons look for occluders.

use super::lanes::{F, V3};
use super::screen::{Pixels, Tap};
use std::f32::consts::PI;

/// Least cosine between normal and view that the tangent plane is followed at. guess
const MOST_GRAZING: f32 = 0.1;

/// A slice of every pixel, spanned by the unit vectors `to_viewer` and one across it, "along".
// Jimenez et al. 2016, §4, Alg. 1: the light of a pixel as an integral over slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slice {
    /// Direction on the screen, y up.
    pub(crate) dx: F,
    pub(crate) dy: F,
    /// Cosine between `to_viewer` and that direction, and one over the sine.
    view_slope: F,
    inverse_along: F,
    axis: V3,
    /// How far to go towards the viewer for a step along `axis` on the tangent plane.
    slide: F,
    /// Length of the normal's projection into the slice.
    pub(crate) normal_length: F,
    /// The projection's angle from `to_viewer`, positive along: cosine, sine and angle [rad].
    pub(crate) cos_n: F,
    pub(crate) sin_n: F,
    pub(crate) n: F,
}

/// Where an occluder is in a slice, seen from the pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InSlice {
    /// Towards the viewer, and along [world units].
    pub(crate) towards: F,
    pub(crate) along: F,
    /// [world units]
    pub(crate) distance: F,
}

impl Slice {
    /// The slice at `turn` half turns from the screen's x axis, in [0, 1].
    #[inline(always)]
    pub(crate) fn new(p: &Pixels, turn: F) -> Self {
        let (dx, dy) = (turn * PI).cos_sin_of_half_turn();
        let v = p.to_viewer;
        let view_slope = dx * v.x + dy * v.y;
        let inverse_along = 1.0 / (1.0 - view_slope * view_slope).max(1e-6).sqrt();
        // (direction, 0) x v
        let axis = V3 { x: dy * v.z, y: -(dx * v.z), z: dx * v.y - dy * v.x } * inverse_along;
        let facing = p.normal.dot(v);
        let along = (dx * p.normal.x + dy * p.normal.y - view_slope * facing) * inverse_along;
        let normal_length = (facing * facing + along * along).max(1e-12).sqrt();
        let (cos_n, sin_n) = (facing / normal_length, along / normal_length);
        let n = cos_n.acos();
        Self {
            dx,
            dy,
            view_slope,
            inverse_along,
            axis,
            slide: p.normal.dot(axis) / facing.max(MOST_GRAZING),
            normal_length,
            cos_n,
            sin_n,
            n: sin_n.lt(0.0).select(-n, n),
        }
    }

    /// The place on the screen so many pixels along.
    #[inline(always)]
    pub(crate) fn place(&self, p: &Pixels, pixels: F) -> (F, F) {
        (p.x + self.dx * pixels, p.y - self.dy * pixels)
    }

    /// Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
    #[inline(always)]
    pub(crate) fn project(&self, p: &Pixels, tap: &Tap) -> InSlice {
        let t = tap.position - p.position;
        let towards = t.dot(p.to_viewer);
        let along = (self.dx * t.x + self.dy * t.y - self.view_slope * towards) * self.inverse_along;
        let towards = towards + t.dot(self.axis) * self.slide;
        InSlice { towards, along, distance: (towards * towards + along * along).max(1e-36).sqrt() }
    }

    /// Light from the angles between the viewer and `angle` (with its cosine), whose sign tells the side, weighted by
    /// the cosine to the projected normal and by the slice's share of the sphere.
    // Jimenez et al. 2016, Eq. 7: an antiderivative of cos(t - n) |sin t|, zero at the viewer.
    #[inline(always)]
    pub(crate) fn arc(&self, angle: F, cos: F) -> F {
        let sin = (1.0 - cos * cos).sqrt();
        let sin = angle.lt(0.0).select(-sin, sin);
        let (cos_2, sin_2) = (2.0 * cos * cos - 1.0, 2.0 * cos * sin);
        (self.cos_n + 2.0 * angle * self.sin_n - (cos_2 * self.cos_n + sin_2 * self.sin_n)) * 0.25
    }

    /// Light of the whole slice when nothing occludes: (cos n + n sin n).
    #[inline(always)]
    pub(crate) fn open(&self) -> F {
        self.cos_n + self.n * self.sin_n
    }
}
