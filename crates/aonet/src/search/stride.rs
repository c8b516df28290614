//! Steps of whole pixels along a slice, whose two ends share most of the arithmetic.

use super::screen::{Pixels, Screen};
use super::slice::Slice;
use crate::frame::BACKGROUND;
use crate::simd::Simd;
use crate::simd::integers::U;
use crate::simd::lanes::{F, Mask};

/// Longest stride (px): beyond every frame, and whole numbers of it are still floats.
const LONGEST: f32 = 65_536.0;

/// A step of every pixel to one beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stride<S: Simd> {
    /// To the right and down (px).
    columns: U<S>,
    rows: U<S>,
    /// In a row-major image.
    places: U<S>,
    /// Towards the viewer, and along the slice: world units for each that a pixel is high.
    towards: F<S>,
    along: F<S>,
}

/// What is at the end of a stride, in its slice and seen from the pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen<S: Simd> {
    /// Towards the viewer, and along the slice (world units).
    pub(crate) towards: F<S>,
    pub(crate) along: F<S>,
    /// Its distance, squared.
    pub(crate) squared: F<S>,
}

impl<S: Simd> Stride<S> {
    /// To the pixel nearest to so many along the slice.
    #[inline(always)]
    pub(crate) fn new(screen: &Screen<'_>, slice: &Slice<S>, pixels: F<S>) -> Self {
        let pixels = pixels.min(LONGEST);
        let (columns, rows) =
            ((slice.dx * pixels * (1.0 / screen.aspect)).round(), (slice.dy * -pixels).round());
        let (right, up) = (columns.float() * screen.aspect, -rows.float());
        Self {
            columns,
            rows,
            places: rows * screen.size().width() as u32 + columns,
            towards: slice.towards.x.mul_add(right, slice.towards.y * up),
            along: slice.along.x.mul_add(right, slice.along.y * up),
        }
    }

    /// As far the other way.
    #[inline(always)]
    pub(crate) fn reversed(self) -> Self {
        Self {
            columns: -self.columns,
            rows: -self.rows,
            places: -self.places,
            towards: -self.towards,
            along: -self.along,
        }
    }

    /// Whether that is in the frame.
    #[inline(always)]
    pub(crate) fn inside(&self, screen: &Screen<'_>, p: &Pixels<S>) -> Mask<S> {
        let size = screen.size();
        (p.column + self.columns).lt(size.width() as u32) & (p.row + self.rows).lt(size.height() as u32)
    }

    /// What is there, moved into the slice along the tangent plane.
    // A pixel's ray goes away from the viewer and not along: where a tap is deeper, only `towards` is less.
    #[inline(always)]
    pub(crate) fn look(&self, screen: &Screen<'_>, p: &Pixels<S>) -> Seen<S> {
        let depth = (p.index + self.places).gather(screen.gbuffer().depth()).min(BACKGROUND);
        let size = screen.pixel_size(depth);
        let farther = (depth + p.position.z) * p.ray_length;
        let (towards, along) = (size.mul_add(self.towards, -farther), size * self.along);
        Seen { towards, along, squared: towards.mul_add(towards, along * along) }
    }
}
