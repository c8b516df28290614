//! Pinhole and orthographic cameras. Right-handed, +Y up, looking along -Z, as glTF and Bevy have it.

use crate::error::{Error, Result};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// How view space maps to the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Vertical field of view [rad], in (0, pi).
        fov_y: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the image plane [world units], > 0.
        height: f32,
    },
}

/// A camera: where it stands, how it projects, how many pixels it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Rigid transform from world to view space.
    pub view_from_world: Affine3A,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Image width [px].
    pub width: usize,
    /// Image height [px].
    pub height: usize,
    /// Distance of the near plane along -Z [world units], >= 0; nothing nearer is seen.
    pub near: f32,
}

/// Largest accepted width or height [px]: keeps every pixel count within `u32`.
pub const MAX_SIDE: usize = 32_768;

impl Camera {
    /// A camera at `eye` that looks at `target`; all in world space.
    ///
    /// # Errors
    /// When a value is not finite, `eye` equals `target`, `up` is parallel to the view, or the
    /// size or field of view is out of range.
    pub fn look_at(
        (eye, target, up): (Vec3, Vec3, Vec3),
        projection: Projection,
        (width, height): (usize, usize),
        near: f32,
    ) -> Result<Self> {
        let forward = (target - eye).normalize_or_zero();
        let right = forward.cross(up).normalize_or_zero();
        if !(eye.is_finite() && forward.is_finite() && right.is_finite()) || right == Vec3::ZERO {
            return Err(Error::value(
                "camera",
                "finite eye, target and up, eye != target, up not parallel to the view",
                format!("eye {eye}, target {target}, up {up}"),
            ));
        }
        let true_up = right.cross(forward);
        let world_from_view = Mat3A::from_cols(right.into(), true_up.into(), (-forward).into());
        let rotation = world_from_view.transpose();
        let view_from_world = Affine3A { matrix3: rotation, translation: -(rotation * Vec3A::from(eye)) };
        Self { view_from_world, projection, width, height, near }.checked()
    }

    /// The same camera after a check of all its fields.
    ///
    /// # Errors
    /// When the transform is not rigid, or the size, near distance or projection is out of range.
    pub fn checked(self) -> Result<Self> {
        check_size("camera", self.width, self.height)?;
        let m = self.view_from_world.matrix3;
        let gram = m * m.transpose();
        let rigid = (gram - Mat3A::IDENTITY).to_cols_array().iter().all(|d| d.abs() < 1e-3);
        if !rigid || m.determinant() < 0.0 || !self.view_from_world.is_finite() {
            return Err(Error::value("camera view_from_world", "a rigid transform", self.view_from_world));
        }
        if !(self.near.is_finite() && self.near >= 0.0) {
            return Err(Error::value("camera near", "a finite distance >= 0", self.near));
        }
        match self.projection {
            Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < std::f32::consts::PI) => {
                Err(Error::value("camera fov_y [rad]", "an angle in (0, pi)", fov_y))
            }
            Projection::Orthographic { height } if !(height > 0.0 && height.is_finite()) => {
                Err(Error::value("camera orthographic height", "a finite length > 0", height))
            }
            Projection::Perspective { .. } | Projection::Orthographic { .. } => Ok(self),
        }
    }

    /// Pixels per view-space unit at distance 1 (perspective) or everywhere (orthographic).
    pub fn focal_px(&self) -> f32 {
        match self.projection {
            Projection::Perspective { fov_y } => 0.5 * self.height as f32 / (0.5 * fov_y).tan(),
            Projection::Orthographic { height } => self.height as f32 / height,
        }
    }

    /// Length in pixels of a `length` [world units] seen at `depth` [world units along -Z].
    pub fn projected_px(&self, length: f32, depth: f32) -> f32 {
        match self.projection {
            Projection::Perspective { .. } => length * self.focal_px() / depth,
            Projection::Orthographic { .. } => length * self.focal_px(),
        }
    }

    /// View-space position of the centre of pixel (`x`, `y`) at `depth` along -Z. Row 0 is the top.
    pub fn position_view(&self, x: usize, y: usize, depth: f32) -> Vec3A {
        let px = (x as f32 + 0.5 - 0.5 * self.width as f32) / self.focal_px();
        let py = (0.5 * self.height as f32 - (y as f32 + 0.5)) / self.focal_px();
        match self.projection {
            Projection::Perspective { .. } => Vec3A::new(px * depth, py * depth, -depth),
            Projection::Orthographic { .. } => Vec3A::new(px, py, -depth),
        }
    }

    /// View-space direction from the surface at `position_view` towards the viewer, unit length.
    pub fn to_viewer(&self, position_view: Vec3A) -> Vec3A {
        match self.projection {
            Projection::Perspective { .. } => (-position_view).normalize_or_zero(),
            Projection::Orthographic { .. } => Vec3A::Z,
        }
    }
}

/// Accepts sizes in `1..=`[`MAX_SIDE`].
///
/// # Errors
/// When a side is 0 or larger than that.
pub fn check_size(what: &str, width: usize, height: usize) -> Result<()> {
    let ok = 1..=MAX_SIDE;
    if ok.contains(&width) && ok.contains(&height) {
        return Ok(());
    }
    Err(Error::size(what, format!("width and height in 1..={MAX_SIDE}"), format!("{width}x{height}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> Camera {
        Camera::look_at((Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y), projection, (640, 360), 0.1).unwrap()
    }

    #[test]
    fn target_is_on_the_axis_at_its_distance() {
        let c = camera(Projection::Perspective { fov_y: 1.0 });
        let p = c.view_from_world.transform_point3(Vec3::ZERO);
        assert!(p.truncate().length() < 1e-5 && (p.z + 14f32.sqrt()).abs() < 1e-5, "{p}");
    }

    #[test]
    fn corner_pixels_span_the_field_of_view() {
        let c = camera(Projection::Perspective { fov_y: 1.0 });
        let top = c.position_view(320, 0, 1.0);
        assert!((top.y - (0.5f32).tan() * (1.0 - 1.0 / 360.0)).abs() < 1e-5);
        let o = camera(Projection::Orthographic { height: 2.0 });
        assert!((o.position_view(320, 359, 5.0).y + 1.0 - 1.0 / 360.0).abs() < 1e-5);
    }

    #[test]
    fn bad_cameras_are_refused() {
        let fov = Projection::Perspective { fov_y: 1.0 };
        assert!(Camera::look_at((Vec3::ZERO, Vec3::ZERO, Vec3::Y), fov, (8, 8), 0.1).is_err());
        assert!(Camera::look_at((Vec3::ZERO, Vec3::Y, Vec3::Y), fov, (8, 8), 0.1).is_err());
        assert!(Camera::look_at((Vec3::ZERO, Vec3::X, Vec3::Y), fov, (0, 8), 0.1).is_err());
        assert!(Camera::look_at((Vec3::ZERO, Vec3::NAN, Vec3::Y), fov, (8, 8), 0.1).is_err());
        let flat = Projection::Perspective { fov_y: 0.0 };
        assert!(Camera::look_at((Vec3::ZERO, Vec3::X, Vec3::Y), flat, (8, 8), 0.1).is_err());
    }
}
