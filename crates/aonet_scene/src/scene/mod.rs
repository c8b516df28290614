//! A scene: one indexed triangle mesh in world space, which is all that ambient occlusion needs, and colours for pictures.

pub mod colours;
pub mod glb;
pub mod gltf;
pub mod ground;
pub mod normals;
pub mod procedural;
pub mod source;
pub mod textures;

pub use normals::MissingNormals;
pub use source::SceneSource;
pub use textures::Textures;

use crate::error::{Error, Result};
use glam::Vec3;
use textures::Decal;

/// Triangles in world space (right-handed, +Y up), opaque and two-sided.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// Its name in manifests and tables.
    pub name: String,
    /// Vertex positions (world units).
    pub position: Vec<Vec3>,
    /// One unit shading normal per vertex.
    pub normal: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub triangle: Vec<[u32; 3]>,
    /// Linear reflectance (red, green, blue) of each triangle in [0, 1], or empty: [`DEFAULT_ALBEDO`] everywhere. Pictures use
    /// it; ambient occlusion does not.
    pub albedo: Vec<[f32; 3]>,
    /// Images on triangles, for pictures as well.
    pub textures: Textures,
}

/// Reflectance of triangles without a colour.
// guess: plaster.
pub const DEFAULT_ALBEDO: [f32; 3] = [0.7; 3];

/// Axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest corner (world units).
    pub min: Vec3,
    /// Largest corner (world units).
    pub max: Vec3,
}

impl Bounds {
    /// Radius of the sphere around the box (world units).
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
        if !self.albedo.is_empty() && self.albedo.len() != self.triangle.len() {
            let found = format!("{} and {}", self.albedo.len(), self.triangle.len());
            return Err(wrong("as many albedos as triangles, or none", found));
        }
        if let Some(t) = self.albedo.iter().position(|a| !a.iter().all(|c| (0.0..=1.0).contains(c))) {
            return Err(wrong("albedos in [0, 1]", format!("{:?} in triangle {t}", self.albedo[t])));
        }
        let Textures { image, decal } = &self.textures;
        if !decal.is_empty() && decal.len() != self.triangle.len() {
            let found = format!("{} and {}", decal.len(), self.triangle.len());
            return Err(wrong("as many decals as triangles, or none", found));
        }
        let is_sound =
            |d: &Decal| (d.image as usize) < image.len() && d.uv.as_flattened().iter().all(|c| c.is_finite());
        if let Some(d) = decal.iter().flatten().find(|d| !is_sound(d)) {
            return Err(wrong(
                &format!("decals with finite coordinates in {} images", image.len()),
                format!("{d:?}"),
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
        if !self.albedo.is_empty() || !other.albedo.is_empty() {
            self.albedo.resize(self.triangle.len(), DEFAULT_ALBEDO);
            self.albedo.extend_from_slice(&other.albedo);
            self.albedo.resize(self.triangle.len() + other.triangle.len(), DEFAULT_ALBEDO);
        }
        self.textures.append(&other.textures, (self.triangle.len(), other.triangle.len()));
        self.position.extend_from_slice(&other.position);
        self.normal.extend_from_slice(&other.normal);
        self.triangle.extend(other.triangle.iter().map(|t| t.map(|i| i + base)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(albedo: Vec<[f32; 3]>) -> Scene {
        let position = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        Scene { position, normal: vec![Vec3::Z; 3], triangle: vec![[0, 1, 2]], albedo, ..Scene::default() }
    }

    #[test]
    fn colours_stay_with_their_triangles() {
        let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let mut scene = triangle(vec![]);
        scene.append(&triangle(vec![]));
        assert!(scene.albedo.is_empty());
        scene.append(&triangle(vec![red]));
        scene.append(&triangle(vec![]));
        scene.append(&triangle(vec![green]));
        assert_eq!(
            scene.checked().unwrap().albedo,
            [DEFAULT_ALBEDO, DEFAULT_ALBEDO, red, DEFAULT_ALBEDO, green]
        );
    }

    #[test]
    fn impossible_colours_are_refused() {
        for albedo in [vec![[0.5; 3]; 2], vec![[0.5, f32::NAN, 0.5]], vec![[1.5, 0.0, 0.0]]] {
            let message = triangle(albedo).checked().unwrap_err().to_string();
            assert!(message.contains("albedo"), "{message}");
        }
    }
}
