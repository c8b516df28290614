//! A scene is one indexed triangle mesh in world space: all that ambient occlusion asks of it.

pub mod gltf;
pub mod ground;
pub mod normals;
pub mod procedural;
pub mod source;

pub use normals::MissingNormals;
pub use source::SceneSource;

use crate::error::{Error, Result};
use glam::Vec3;

/// Triangles in world space (right-handed, +Y up), opaque and two-sided.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// What it is called in manifests and tables.
    pub name: String,
    /// Vertex positions [world units].
    pub position: Vec<Vec3>,
    /// One unit shading normal a vertex.
    pub normal: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub triangle: Vec<[u32; 3]>,
}

/// Axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest corner [world units].
    pub min: Vec3,
    /// Largest corner [world units].
    pub max: Vec3,
}

impl Bounds {
    /// Radius of the sphere around the box [world units].
    pub fn radius(&self) -> f32 {
        0.5 * (self.max - self.min).length()
    }

    /// Middle of the box.
    pub fn centre(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }
}

impl Scene {
    /// The scene after a check: equal lengths, finite positions, unit normals, indices in range, not empty.
    ///
    /// # Errors
    /// Names the scene and the first thing that is wrong.
    pub fn checked(self) -> Result<Self> {
        let wrong =
            |expected: &str, found: String| Error::request(format!("scene {}", self.name), expected, found);
        if self.triangle.is_empty() {
            return Err(wrong("at least one triangle", "none".into()));
        }
        if self.position.len() != self.normal.len() {
            let found = format!("{} and {}", self.position.len(), self.normal.len());
            return Err(wrong("as many normals as positions", found));
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            return Err(wrong("finite positions", format!("{} at vertex {i}", self.position[i])));
        }
        if let Some(i) = self.normal.iter().position(|n| !((n.length() - 1.0).abs() < 1e-2)) {
            return Err(wrong("unit normals", format!("{} at vertex {i}", self.normal[i])));
        }
        let n = self.position.len() as u32;
        if let Some(t) = self.triangle.iter().position(|t| t.iter().any(|&i| i >= n)) {
            return Err(wrong(
                &format!("indices below {n}"),
                format!("{:?} in triangle {t}", self.triangle[t]),
            ));
        }
        Ok(self)
    }

    /// Box around all vertices.
    pub fn bounds(&self) -> Bounds {
        let empty = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
        self.position.iter().fold(empty, |b, p| Bounds { min: b.min.min(*p), max: b.max.max(*p) })
    }

    /// Appends the triangles of `other`.
    pub fn append(&mut self, other: &Scene) {
        let base = self.position.len() as u32;
        self.position.extend_from_slice(&other.position);
        self.normal.extend_from_slice(&other.normal);
        self.triangle.extend(other.triangle.iter().map(|t| t.map(|i| i + base)));
    }
}
