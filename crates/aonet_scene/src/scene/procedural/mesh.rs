//! A mesh under construction, and where it is put.

use super::Scene;
use glam::{Mat3, Vec2, Vec3};
use std::ops::Mul;

/// (cos, sin) of an angle (rad), the same on every platform.
pub(super) fn turn(angle: f32) -> Vec2 {
    Vec2::new(libm::cosf(angle), libm::sinf(angle))
}

/// Where a mesh is put: a linear map, then an offset. Methods apply before what is already there, so
/// `Pose::at(x, y, z).yaw(a).scale(s)` scales, then turns, then moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose {
    pub(super) linear: Mat3,
    pub(super) offset: Vec3,
}

impl Pose {
    pub(super) const IDENTITY: Self = Self { linear: Mat3::IDENTITY, offset: Vec3::ZERO };

    pub(super) fn at(x: f32, y: f32, z: f32) -> Self {
        Self { linear: Mat3::IDENTITY, offset: Vec3::new(x, y, z) }
    }

    pub(super) fn shift(self, x: f32, y: f32, z: f32) -> Self {
        self * Self::at(x, y, z)
    }

    /// Turns by `angle` (rad) about +Y: from +Z towards +X.
    pub(super) fn yaw(self, angle: f32) -> Self {
        let t = turn(angle);
        self.map(Mat3::from_cols_array(&[t.x, 0.0, -t.y, 0.0, 1.0, 0.0, t.y, 0.0, t.x]))
    }

    /// Turns by `angle` (rad) about +X: from +Y towards +Z.
    pub(super) fn pitch(self, angle: f32) -> Self {
        let t = turn(angle);
        self.map(Mat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, t.x, t.y, 0.0, -t.y, t.x]))
    }

    /// Turns by `angle` (rad) about +Z: from +X towards +Y.
    pub(super) fn roll(self, angle: f32) -> Self {
        let t = turn(angle);
        self.map(Mat3::from_cols_array(&[t.x, t.y, 0.0, -t.y, t.x, 0.0, 0.0, 0.0, 1.0]))
    }

    pub(super) fn scale(self, s: f32) -> Self {
        self.stretch(s, s, s)
    }

    pub(super) fn stretch(self, x: f32, y: f32, z: f32) -> Self {
        self.map(Mat3::from_diagonal(Vec3::new(x, y, z)))
    }

    /// Turns +Y to the unit vector `up`.
    pub(super) fn stand_on(self, up: Vec3) -> Self {
        let (a, b) = up.any_orthonormal_pair();
        self.map(Mat3::from_cols(b, up, a))
    }

    pub(super) fn map(self, linear: Mat3) -> Self {
        Self { linear: self.linear * linear, ..self }
    }

    pub(super) fn apply(self, p: Vec3) -> Vec3 {
        self.linear * p + self.offset
    }
}

impl Mul for Pose {
    type Output = Self;

    fn mul(self, inner: Self) -> Self {
        Self { linear: self.linear * inner.linear, offset: self.apply(inner.offset) }
    }
}

/// Indexed triangles, counter-clockwise seen from the front, with one unit normal a vertex.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub(super) position: Vec<Vec3>,
    pub(super) normal: Vec<Vec3>,
    pub(super) triangle: Vec<[u32; 3]>,
}

impl Mesh {
    /// Appends `other` at `pose`. A mirroring pose keeps the front outside.
    pub(super) fn add(&mut self, other: &Mesh, pose: Pose) {
        let base = self.position.len() as u32;
        let m = pose.linear;
        let cofactor =
            Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        let mirrored = m.determinant() < 0.0;
        let sign = if mirrored { -1.0 } else { 1.0 };
        self.position.extend(other.position.iter().map(|p| pose.apply(*p)));
        self.normal.extend(other.normal.iter().map(|n| (cofactor * *n * sign).normalize_or(Vec3::Y)));
        self.triangle.extend(other.triangle.iter().map(|&[a, b, c]| {
            let t = if mirrored { [a, c, b] } else { [a, b, c] };
            t.map(|i| i + base)
        }));
    }

    /// The mesh moved to `pose`.
    pub(super) fn at(&self, pose: Pose) -> Mesh {
        let mut placed = Mesh::default();
        placed.add(self, pose);
        placed
    }

    /// A triangle soup without normals yet; finish it with [`Mesh::shade`].
    pub(super) fn push(&mut self, corners: [Vec3; 3]) {
        let base = self.position.len() as u32;
        self.position.extend(corners);
        self.normal.extend([Vec3::Y; 3]);
        self.triangle.push([base, base + 1, base + 2]);
    }

    /// Two triangles for the corners a, b, c, d in counter-clockwise order.
    pub(super) fn push_quad(&mut self, [a, b, c, d]: [Vec3; 4]) {
        self.push([a, b, c]);
        self.push([a, c, d]);
    }

    /// The same triangles with new normals: smooth over edges whose faces meet at less than `crease`
    /// (degrees), sharp over others; 0 is flat everywhere. Vertices at one place are welded first.
    pub(super) fn shade(&self, crease: f32) -> Mesh {
        let face: Vec<Vec3> = self.triangle.iter().map(|t| self.area_vector(*t)).collect();
        let unit: Vec<Vec3> = face.iter().map(|n| n.normalize_or_zero()).collect();
        let place = self.welded();
        let mut corners: Vec<(u32, u32)> = (0..self.triangle.len() as u32)
            .flat_map(|t| self.triangle[t as usize].map(|v| (place[v as usize], t)))
            .collect();
        corners.sort_unstable();
        corners.dedup();
        let cos_crease = turn(crease.to_radians()).x - 1e-5;
        let mut out = Mesh { triangle: self.triangle.clone(), ..Default::default() };
        for around in corners.chunk_by(|a, b| a.0 == b.0) {
            let first = out.position.len();
            for &(vertex, t) in around {
                let near = around.iter().filter(|o| unit[o.1 as usize].dot(unit[t as usize]) >= cos_crease);
                let sum: Vec3 = near.map(|o| face[o.1 as usize]).sum();
                let normal = sum.normalize_or(unit[t as usize].normalize_or(Vec3::Y));
                let known = out.normal[first..].iter().position(|n| *n == normal);
                let index = known.map_or(out.position.len(), |k| first + k);
                if known.is_none() {
                    out.position.push(self.position[vertex as usize]);
                    out.normal.push(normal);
                }
                let old = self.triangle[t as usize];
                let new = &mut out.triangle[t as usize];
                (0..3).filter(|&k| place[old[k] as usize] == vertex).for_each(|k| new[k] = index as u32);
            }
        }
        out
    }

    /// For each vertex the first vertex at the same place.
    fn welded(&self) -> Vec<u32> {
        let key = |i: u32| self.position[i as usize].to_array().map(|c| (c + 0.0).to_bits());
        let mut order: Vec<u32> = (0..self.position.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (key(i), i));
        let mut place = vec![0; order.len()];
        for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
            same.iter().for_each(|&i| place[i as usize] = same[0]);
        }
        place
    }

    /// The mesh after a smooth map of space; normals follow the map's derivative.
    pub(super) fn warp(&self, map: impl Fn(Vec3) -> Vec3) -> Mesh {
        let step = 1e-3;
        let bend = |(p, n): (&Vec3, &Vec3)| {
            let (a, b) = n.any_orthonormal_pair();
            let along = |d: Vec3| map(*p + d * step) - map(*p - d * step);
            along(a).cross(along(b)).normalize_or(*n)
        };
        Mesh {
            position: self.position.iter().map(|p| map(*p)).collect(),
            normal: self.position.iter().zip(&self.normal).map(bend).collect(),
            triangle: self.triangle.clone(),
        }
    }

    /// Normal of a triangle, as long as twice its area.
    pub(super) fn area_vector(&self, [a, b, c]: [u32; 3]) -> Vec3 {
        let [a, b, c] = [a, b, c].map(|i| self.position[i as usize]);
        (b - a).cross(c - a)
    }

    /// Smallest and largest corner.
    pub(super) fn extent(&self) -> (Vec3, Vec3) {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        self.position.iter().fold(empty, |(lo, hi), p| (lo.min(*p), hi.max(*p)))
    }

    /// The finished scene, without triangles that have no area.
    pub(super) fn into_scene(mut self, name: String) -> Scene {
        let kept = |t: &[u32; 3]| self.area_vector(*t).length_squared() > 1e-18;
        let triangle = self.triangle.iter().copied().filter(kept).collect();
        self.triangle = triangle;
        Scene {
            name,
            position: self.position,
            normal: self.normal,
            triangle: self.triangle,
            ..Scene::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural::shapes::cuboid;
    use glam::vec3;

    #[test]
    fn a_crease_angle_splits_the_edges_above_it() {
        let cube = cuboid(Vec3::ONE);
        assert_eq!((cube.position.len(), cube.triangle.len()), (24, 12));
        assert_eq!(cube.shade(91.0).position.len(), 8);
        assert!(
            cube.shade(91.0)
                .normal
                .iter()
                .all(|n| (n.abs().min_element() - n.abs().max_element()).abs() < 0.5)
        );
    }

    #[test]
    fn poses_apply_the_last_method_first() {
        let p = Pose::at(1.0, 0.0, 0.0).yaw(std::f32::consts::FRAC_PI_2).scale(2.0).apply(Vec3::Z);
        assert!(p.distance(vec3(3.0, 0.0, 0.0)) < 1e-5, "{p}");
        let nested =
            (Pose::at(1.0, 2.0, 3.0).roll(0.3) * Pose::at(0.5, 0.0, 0.0).pitch(0.7)).apply(Vec3::ONE);
        let step = Pose::at(0.5, 0.0, 0.0).pitch(0.7).apply(Vec3::ONE);
        assert!(nested.distance(Pose::at(1.0, 2.0, 3.0).roll(0.3).apply(step)) < 1e-5);
    }

    #[test]
    fn a_mirror_keeps_the_front_outside() {
        let volume = |mesh: &Mesh| -> f32 {
            mesh.triangle.iter().map(|t| mesh.area_vector(*t).dot(mesh.position[t[0] as usize]) / 6.0).sum()
        };
        let mirrored = cuboid(vec3(1.0, 2.0, 3.0)).at(Pose::at(5.0, 0.0, 0.0).stretch(-2.0, 1.0, 1.0));
        assert!((volume(&mirrored) - 12.0).abs() < 1e-4, "{}", volume(&mirrored));
        let outward = |t: &[u32; 3]| mirrored.area_vector(*t).dot(mirrored.normal[t[0] as usize]) > 0.0;
        assert!(mirrored.triangle.iter().all(outward));
    }
}
