//! The frame as the methods see it: positions and depths of sixteen pixels at once.

use super::lanes::{F, LANES, Mask, V3};
use crate::ao_image::AoParams;
use crate::camera::Projection;
use crate::gbuffer::GBuffer;

/// Depth of the background: beyond every scene, and its square is still a float.
pub(super) const BACKGROUND: f32 = 1e18;

/// A frame, its camera and the AO radius.
#[derive(Debug)]
pub(crate) struct Screen<'a> {
    gbuffer: &'a GBuffer,
    /// AO radius [world units].
    pub(crate) radius: f32,
    /// World units a pixel: the first times the depth plus the second. One of them is 0.
    pixel_size: [f32; 2],
    perspective: bool,
}

/// Neighbouring pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixels {
    /// Pixel coordinates; whole numbers are the centres.
    pub(crate) x: F,
    pub(crate) y: F,
    /// View space.
    pub(crate) position: V3,
    pub(crate) normal: V3,
    /// Unit vector towards the camera.
    pub(crate) to_viewer: V3,
    /// The AO radius on the screen [px].
    pub(crate) radius_px: F,
}

/// What a place on the screen shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tap {
    /// View-space position; far away on the background.
    pub(crate) position: V3,
    /// Row-major index of the pixel.
    pub(crate) index: [u32; LANES],
    /// Whether the place lies in the frame.
    pub(crate) inside: Mask,
}

impl<'a> Screen<'a> {
    pub(crate) fn new(gbuffer: &'a GBuffer, params: AoParams) -> Self {
        let camera = gbuffer.camera();
        let focal = camera.focal_px();
        let perspective = matches!(camera.projection, Projection::Perspective { .. });
        let pixel_size = if perspective { [1.0 / focal, 0.0] } else { [0.0, 1.0 / focal] };
        Self { gbuffer, radius: params.radius, pixel_size, perspective }
    }

    pub(crate) fn gbuffer(&self) -> &'a GBuffer {
        self.gbuffer
    }

    /// Width and height [px].
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.gbuffer.width(), self.gbuffer.height())
    }

    /// The pixels from (`x`, `y`) on; beyond the row, its last pixel again.
    #[inline(always)]
    pub(crate) fn pixels(&self, x: usize, y: usize) -> Pixels {
        let (row, last) = (y * self.gbuffer.width(), self.gbuffer.width() - 1);
        let (mut depth, mut normal) = ([1.0; LANES], [[0.0; LANES]; 3]);
        for i in 0..LANES {
            let at = row + (x + i).min(last);
            let found = self.gbuffer.depth()[at];
            // Any finite depth will do where there is none.
            depth[i] = if found < BACKGROUND { found } else { 1.0 };
            let n = self.gbuffer.normal()[at];
            for c in 0..3 {
                normal[c][i] = n[c];
            }
        }
        let depth = F(depth);
        let (px, py) = (F::counting_from(x as f32), F::from(y as f32));
        let position = self.position(px, py, depth);
        Pixels {
            x: px,
            y: py,
            position,
            normal: V3 { x: F(normal[0]), y: F(normal[1]), z: F(normal[2]) },
            to_viewer: self.to_viewer(position),
            radius_px: self.radius / self.pixel_size(depth),
        }
    }

    /// View-space position of a place on the screen at a depth.
    #[inline(always)]
    pub(crate) fn position(&self, x: F, y: F, depth: F) -> V3 {
        let (width, height) = (self.gbuffer.width() as f32, self.gbuffer.height() as f32);
        let scale = self.pixel_size(depth);
        V3 { x: (x + (0.5 - 0.5 * width)) * scale, y: ((0.5 * height - 0.5) - y) * scale, z: -depth }
    }

    /// The place on the screen (x, y) [px] of a view-space position in front of the camera.
    #[inline(always)]
    pub(crate) fn place(&self, position: V3) -> (F, F) {
        let (width, height) = (self.gbuffer.width() as f32, self.gbuffer.height() as f32);
        let scale = 1.0 / self.pixel_size(-position.z);
        (position.x * scale + (0.5 * width - 0.5), (0.5 * height - 0.5) - position.y * scale)
    }

    /// World units a pixel at a depth.
    #[inline(always)]
    pub(crate) fn pixel_size(&self, depth: F) -> F {
        depth * self.pixel_size[0] + self.pixel_size[1]
    }

    /// Unit vector from a view-space position towards the camera.
    #[inline(always)]
    pub(crate) fn to_viewer(&self, position: V3) -> V3 {
        if self.perspective { (position * -1.0).normalized() } else { V3::new(0.0, 0.0, 1.0) }
    }

    /// The pixel nearest to a place on the screen: the edge's where it is outside.
    #[inline(always)]
    pub(crate) fn tap(&self, x: F, y: F) -> Tap {
        let (width, height) = self.size();
        let (columns, rows) = (x.index(width - 1), y.index(height - 1));
        let (mut index, mut depth) = ([0; LANES], [0.0; LANES]);
        let (mut cx, mut cy) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            index[i] = rows[i] * width as u32 + columns[i];
            (cx[i], cy[i]) = (columns[i] as f32, rows[i] as f32);
        }
        for i in 0..LANES {
            depth[i] = self.gbuffer.depth()[index[i] as usize];
        }
        let depth = F(depth).min(BACKGROUND);
        let outside = (x - F(cx)).abs().max((y - F(cy)).abs());
        Tap { position: self.position(F(cx), F(cy), depth), index, inside: outside.le(0.5) }
    }

    /// View-space normal of a pixel; zero on the background.
    #[inline(always)]
    pub(crate) fn normal(&self, index: [u32; LANES]) -> V3 {
        let mut normal = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let n = self.gbuffer.normal()[index[i] as usize];
            for c in 0..3 {
                normal[c][i] = n[c];
            }
        }
        V3 { x: F(normal[0]), y: F(normal[1]), z: F(normal[2]) }
    }
}
