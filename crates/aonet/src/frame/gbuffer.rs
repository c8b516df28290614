//! What screen space knows: depth and normal of every pixel, and the camera that saw them.

use crate::error::{Error, Result};
use crate::frame::camera::Camera;
use crate::frame::size::Size;

/// How far a normal's length may be from 1. guess: loose enough for half floats and 8-bit textures.
const UNIT_TOLERANCE: f32 = 0.05;

/// Share of the foreground whose normals may face away from the viewer. Interpolated shading normals
/// do so near silhouettes; a world-space buffer does so on about half of the pixels.
/// guess: between the two.
const MAX_BACKFACING: f32 = 0.35;

/// Depth and normals of one frame. Checked once, at construction.
#[derive(Debug, Clone, PartialEq)]
pub struct GBuffer {
    camera: Camera,
    depth: Vec<f32>,
    normal: Vec<[f32; 3]>,
}

impl GBuffer {
    /// A frame from HxW `depth` (distance along -Z (world units), > 0, infinite on the background) and
    /// HxW view-space `normal` (unit length; ignored and set to zero on the background).
    ///
    /// Interpolated shading normals may look away from the viewer near silhouettes, so single pixels with
    /// dot(n, p) >= 0 are kept; a buffer in which many do is refused as not being in view space.
    ///
    /// # Errors
    /// When a length is wrong, a depth is NaN or not above zero, a normal is not finite or not of
    /// unit length, or most of the normals cannot be in view space.
    pub fn new(camera: Camera, mut depth: Vec<f32>, mut normal: Vec<[f32; 3]>) -> Result<Self> {
        let (width, pixels) = (camera.width(), camera.size().pixels());
        if depth.len() != pixels || normal.len() != pixels {
            let expected = format!("{pixels} values of depth and normal");
            let found = format!("{} and {}", depth.len(), normal.len());
            return Err(Error::size("G-buffer", expected, found));
        }
        let (mut foreground, mut backfacing) = (0usize, 0usize);
        for (i, (d, n)) in depth.iter_mut().zip(&mut normal).enumerate() {
            let (x, y) = (i % width, i / width);
            if *d == f32::INFINITY {
                *n = [0.0; 3];
                continue;
            }
            if !(*d > 0.0) {
                return Err(Error::value(format!("depth at ({x}, {y})"), "a distance > 0 or infinity", *d));
            }
            let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
            if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
                let found = format!("{n:?} of length {length}");
                return Err(Error::value(format!("normal at ({x}, {y})"), "a unit vector", found));
            }
            *n = n.map(|c| c / length);
            let p = camera.position_view(x, y, *d);
            foreground += 1;
            backfacing += usize::from(camera.to_viewer(p).dot((*n).into()) < -0.05);
        }
        if backfacing as f32 > MAX_BACKFACING * foreground as f32 {
            let found = format!("{backfacing} of {foreground} normals that face away from it");
            return Err(Error::value("normals", "view space: towards the viewer", found));
        }
        Ok(Self { camera, depth, normal })
    }

    /// The camera that saw the frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Size (px).
    pub fn size(&self) -> Size {
        self.camera.size()
    }

    /// Width (px).
    pub fn width(&self) -> usize {
        self.camera.width()
    }

    /// Height (px).
    pub fn height(&self) -> usize {
        self.camera.height()
    }

    /// HxW distances along -Z (world units), row by row from the top; infinite on the background.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// HxW view-space normals, row by row from the top; zero on the background.
    pub fn normal(&self) -> &[[f32; 3]] {
        &self.normal
    }

    /// Whether pixel `i` (row-major) shows geometry.
    pub fn is_foreground(&self, i: usize) -> bool {
        self.depth[i] != f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    fn camera() -> Camera {
        Camera::perspective(1.0, Size::px(2, 1)).unwrap()
    }

    #[test]
    fn background_normals_become_zero() {
        let g = GBuffer::new(camera(), vec![1.0, f32::INFINITY], vec![[0.0, 0.0, 1.0]; 2]).unwrap();
        assert_eq!(g.normal()[1], [0.0; 3]);
        assert!(g.is_foreground(0) && !g.is_foreground(1));
    }

    #[test]
    fn bad_buffers_are_refused_with_the_pixel() {
        let up = [0.0, 0.0, 1.0];
        let error = |d: [f32; 2], n: [[f32; 3]; 2]| {
            GBuffer::new(camera(), d.to_vec(), n.to_vec()).unwrap_err().to_string()
        };
        assert!(error([1.0, f32::NAN], [up, up]).contains("depth at (1, 0)"));
        assert!(error([0.0, 1.0], [up, up]).contains("depth at (0, 0)"));
        assert!(error([1.0, 1.0], [up, [0.0, 0.0, 2.0]]).contains("normal at (1, 0)"));
        assert!(error([1.0, 1.0], [up, [f32::NAN, 0.0, 1.0]]).contains("normal at (1, 0)"));
        assert!(error([1.0, 1.0], [[0.0, 0.0, -1.0]; 2]).contains("face away"));
        assert!(GBuffer::new(camera(), vec![1.0], vec![up; 2]).is_err());
    }
}
