//! The camera of a frame in f64.

use crate::frame::gbuffer::GBuffer;
use glam::DVec3;

/// How pixels map to view space.
pub(super) struct Lens {
    perspective: bool,
    /// Pixels (x, y) for a world unit at depth 1; at every depth in parallel projection.
    focal_px: [f64; 2],
    /// Where the axis meets the frame (x, y), px; whole numbers are the centres of pixels.
    centre: [f64; 2],
}

impl Lens {
    pub(super) fn new(gbuffer: &GBuffer) -> Self {
        let camera = gbuffer.camera();
        Self {
            perspective: camera.is_perspective(),
            focal_px: camera.focal_px().map(f64::from),
            centre: camera.centre_px().map(|c| f64::from(c) - 0.5),
        }
    }

    /// View-space position of a pixel at a depth.
    pub(super) fn position(&self, x: usize, y: usize, depth: f64) -> DVec3 {
        self.place([x as f64, y as f64], depth)
    }

    /// View-space position of a place (x, y) of the screen (px) at a depth.
    pub(super) fn place(&self, [x, y]: [f64; 2], depth: f64) -> DVec3 {
        let [width, height] =
            self.focal_px.map(|focal| if self.perspective { depth / focal } else { 1.0 / focal });
        DVec3::new((x - self.centre[0]) * width, (self.centre[1] - y) * height, -depth)
    }

    /// Unit vector from a pixel towards the camera.
    pub(super) fn to_viewer(&self, x: usize, y: usize) -> DVec3 {
        if self.perspective { -self.position(x, y, 1.0).normalize() } else { DVec3::Z }
    }

    /// Unit vector away from the camera through a place (x, y) of the screen (px).
    pub(super) fn ray(&self, at: [f64; 2]) -> DVec3 {
        (self.place(at, 2.0) - self.place(at, 1.0)).normalize()
    }

    /// How many pixels are as high as a length (world units) at a depth.
    pub(super) fn projected_px(&self, length: f64, depth: f64) -> f64 {
        if self.perspective { length * self.focal_px[1] / depth } else { length * self.focal_px[1] }
    }

    /// How many pixels side by side are as wide as one is high.
    pub(super) fn columns_for_a_row(&self) -> f64 {
        self.focal_px[0] / self.focal_px[1]
    }
}
