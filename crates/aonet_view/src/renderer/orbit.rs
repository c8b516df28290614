//! A camera for mouse and keyboard: it moves around a point, or through the scene.

use aonet::{Camera, Result, Size};
use aonet_scene::View;
use glam::Vec3;

/// A point, and a viewer at a distance who looks at it. Right-handed, +Y up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// World space.
    pub target: Vec3,
    /// From the viewer to the target (world units), > 0.
    pub distance: f32,
    /// Direction of the view about +Y (rad): 0 looks along -Z, positive turns to the left.
    pub yaw: f32,
    /// Direction of the view above the horizon (rad).
    pub pitch: f32,
}

/// Largest pitch: straight up or down has no left and right. guess: one degree less.
const MOST_PITCH: f32 = 1.55;

/// Nearest and farthest distances (world units), so that nothing overflows.
const DISTANCES: (f32, f32) = (1e-4, 1e7);

impl Orbit {
    /// The viewer at `eye` who looks at `target`.
    pub fn new(eye: Vec3, target: Vec3) -> Self {
        let look = target - eye;
        let distance = look.length().clamp(DISTANCES.0, DISTANCES.1);
        let flat = look.x.hypot(look.z);
        let pitch = look.y.atan2(flat).clamp(-MOST_PITCH, MOST_PITCH);
        Self { target, distance, yaw: (-look.x).atan2(-look.z), pitch }
    }

    /// The camera position of a view.
    pub fn of_view(view: &View) -> Self {
        Self::new(Vec3::from(view.eye), Vec3::from(view.target))
    }

    /// Unit direction of the view, world space.
    pub fn forward(&self) -> Vec3 {
        let (sin, cos) = self.pitch.sin_cos();
        Vec3::new(-self.yaw.sin() * cos, sin, -self.yaw.cos() * cos)
    }

    /// Unit direction to the right of the picture, world space.
    pub fn right(&self) -> Vec3 {
        Vec3::new(self.yaw.cos(), 0.0, -self.yaw.sin())
    }

    /// Where the viewer stands, world space.
    pub fn eye(&self) -> Vec3 {
        self.target - self.distance * self.forward()
    }

    /// Turns about the target by angles (rad): to the left, and up.
    pub fn turn(&mut self, yaw: f32, pitch: f32) {
        self.yaw = (self.yaw + yaw) % std::f32::consts::TAU;
        self.pitch = (self.pitch + pitch).clamp(-MOST_PITCH, MOST_PITCH);
    }

    /// Turns the head by angles (rad): to the left, and up. The viewer stays where it is.
    pub fn look(&mut self, yaw: f32, pitch: f32) {
        let eye = self.eye();
        self.turn(yaw, pitch);
        self.target = eye + self.distance * self.forward();
    }

    /// Moves viewer and target: to the right, up in the world, and forward (world units).
    pub fn walk(&mut self, step: Vec3) {
        self.target += step.x * self.right() + step.y * Vec3::Y + step.z * self.forward();
    }

    /// Moves viewer and target in the plane of the picture by parts of the target's distance: to the right, and up.
    pub fn pan(&mut self, right: f32, up: f32) {
        let above = self.right().cross(self.forward());
        self.target += self.distance * (right * self.right() + up * above);
    }

    /// Multiplies the distance to the target.
    pub fn zoom(&mut self, factor: f32) {
        self.distance = (self.distance * factor).clamp(DISTANCES.0, DISTANCES.1);
    }

    /// The camera with a vertical field of view (rad), for pictures of `size`.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn camera(&self, fov_y: f32, size: Size, near: f32) -> Result<Camera> {
        Camera::perspective(fov_y, size)?.with_near(near)?.looking_at(self.eye(), self.target, Vec3::Y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vec3, b: Vec3) {
        assert!(a.distance(b) < 1e-4, "{a} {b}");
    }

    #[test]
    fn eye_and_target_come_back() {
        for (eye, target) in [
            (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 0.5, 0.0)),
            (Vec3::ZERO, Vec3::X),
            (Vec3::ZERO, Vec3::Z),
            (Vec3::new(0.0, 5.0, -4.0), Vec3::ZERO),
        ] {
            let orbit = Orbit::new(eye, target);
            near(orbit.eye(), eye);
            near(orbit.target, target);
            near(orbit.forward(), (target - eye).normalize());
            let camera = orbit.camera(1.0, Size::px(8, 8), 0.1).unwrap();
            near(camera.view_from_world().transform_vector3(orbit.right()), Vec3::X);
        }
    }

    #[test]
    fn turning_keeps_the_target_and_looking_keeps_the_eye() {
        let start = Orbit::new(Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO);
        let mut turned = start;
        turned.turn(0.5, 0.2);
        near(turned.target, start.target);
        assert!(turned.eye().distance(start.eye()) > 1.0);
        let mut looked = start;
        looked.look(0.5, 0.2);
        near(looked.eye(), start.eye());
        assert!(looked.target.distance(start.target) > 1.0);
        // -X is to the left of a viewer who looks along -Z.
        assert!(looked.forward().x < start.forward().x);
    }

    #[test]
    fn steps_go_where_they_say() {
        let start = Orbit::new(Vec3::ZERO, -2.0 * Vec3::Z);
        let moved = |change: fn(&mut Orbit)| {
            let mut orbit = start;
            change(&mut orbit);
            orbit.eye() - start.eye()
        };
        near(moved(|o| o.walk(Vec3::new(1.0, 2.0, 3.0))), Vec3::new(1.0, 2.0, -3.0));
        near(moved(|o| o.pan(0.5, 0.25)), Vec3::new(1.0, 0.5, 0.0));
        near(moved(|o| o.zoom(2.0)), Vec3::new(0.0, 0.0, 2.0));
    }

    #[test]
    fn no_move_makes_a_camera_that_cannot_be() {
        let mut orbit = Orbit::new(Vec3::ZERO, Vec3::Y);
        for _ in 0..100 {
            orbit.turn(1.0, 1.0);
            orbit.zoom(1e-3);
            orbit.camera(1.0, Size::px(8, 8), 0.0).unwrap();
        }
        orbit.zoom(f32::MAX);
        assert!(orbit.camera(1.0, Size::px(8, 8), 0.0).is_ok());
    }
}
