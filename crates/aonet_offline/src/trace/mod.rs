//! Rays against a scene: an 8-wide bounding volume hierarchy.

use crate::Scene;
use glam::Vec3A;

/// A scene with its hierarchy, ready for rays. Immutable; share it between threads.
pub struct Tracer {}

/// The nearest intersection of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray in lengths of its direction.
    pub t: f32,
    /// Index into [`Scene::triangle`].
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
}

impl Tracer {
    /// Builds the hierarchy.
    pub fn new(_scene: Scene) -> Self {
        unimplemented!()
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        unimplemented!()
    }

    /// Whether any triangle lies at 0 < t <= `t_max` along the ray.
    pub fn occluded(&self, _origin: Vec3A, _direction: Vec3A, _t_max: f32) -> bool {
        unimplemented!()
    }

    /// The nearest triangle at 0 < t <= `t_max`.
    pub fn closest(&self, _origin: Vec3A, _direction: Vec3A, _t_max: f32) -> Option<Hit> {
        unimplemented!()
    }
}
