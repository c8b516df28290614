//! The viewer's position and the far plane.

use aonet::{Camera, Result, Size};
use aonet_scene::View;
use aonet_scene::scene::Bounds;
use aonet_view::renderer::Orbit;

/// A camera for mouse and keyboard, and lengths that suit the scene (world units).
pub(crate) struct Stage {
    pub(crate) orbit: Orbit,
    /// Vertical field of view (degrees).
    fov_y_deg: f32,
    near: f32,
    pub(crate) far: f32,
    /// The initial AO radius.
    pub(crate) radius: f32,
}

/// For scenes from files: vertical field of view (degrees), direction of the view (rad), and the AO radius in radii of the
/// scene.
// guess: a portrait of an object from somewhat above.
const FOV_Y_DEG: f32 = 40.0;
const YAW: f32 = 0.6;
const PITCH: f32 = -0.35;
const RADIUS: f32 = 0.1;

impl Stage {
    /// The camera of a view.
    pub(crate) fn of_view(view: &View) -> Self {
        Self {
            orbit: Orbit::of_view(view),
            fov_y_deg: view.fov_y_deg,
            near: view.near,
            far: view.far,
            radius: view.radius,
        }
    }

    /// A camera that sees the whole scene.
    pub(crate) fn around(bounds: Bounds) -> Self {
        let radius = bounds.radius();
        let mut orbit = Orbit::new(bounds.centre() + radius * glam::Vec3::Z, bounds.centre());
        orbit.turn(YAW, PITCH);
        orbit.zoom(1.0 / (0.5 * FOV_Y_DEG.to_radians()).sin());
        Self { orbit, fov_y_deg: FOV_Y_DEG, near: 0.0, far: f32::INFINITY, radius: RADIUS * radius }
    }

    /// The camera for frames of `size`.
    ///
    /// # Errors
    /// When the orbit or the near plane is out of range.
    pub(crate) fn camera(&self, size: Size) -> Result<Camera> {
        self.orbit.camera(self.fov_y_deg.to_radians(), size, self.near)
    }

    /// A view for the command line, with frames of `size` and an AO radius (world units).
    pub(crate) fn view(&self, size: Size, radius: f32) -> View {
        View {
            eye: self.orbit.eye().to_array(),
            target: self.orbit.target.to_array(),
            up: [0.0, 1.0, 0.0],
            fov_y_deg: self.fov_y_deg,
            ortho_height: None,
            width: size.width(),
            height: size.height(),
            near: self.near,
            far: self.far,
            radius,
            margin: 0.0,
            separation: None,
        }
    }
}
