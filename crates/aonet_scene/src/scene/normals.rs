//! Shading normals for meshes that have none, or unusable ones.

use super::Scene;
use crate::error::Result;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Treatment of meshes without normals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum MissingNormals {
    /// The normal of each triangle, as glTF specifies.
    #[default]
    Flat,
    /// Smooth across edges that bend less than an angle, as modelling programs do.
    Crease {
        /// Largest angle between the normals of two faces that shade as one surface (degrees), 0 to 180.
        angle_deg: f32,
    },
}

impl MissingNormals {
    /// Crease normals at 40 degrees, for files whose authors meant smooth surfaces.
    // guess: between the 30 degrees that modelling programs start from and the 45 of an octagonal column.
    pub const CREASE: Self = Self::Crease { angle_deg: 40.0 };

    /// Returns the value after a check of its angle.
    ///
    /// # Errors
    /// When the angle is not in 0 to 180 degrees.
    pub fn checked(self) -> Result<Self> {
        match self {
            Self::Crease { angle_deg } if !(0.0..=180.0).contains(&angle_deg) => {
                Err(aonet::Error::value("crease angle [degrees]", "0 to 180", angle_deg).into())
            }
            Self::Flat | Self::Crease { .. } => Ok(self),
        }
    }
}

/// Unit normal of a triangle and twice its area; `None` where it has no area, or no finite one.
/// In f64: products of f32 differences neither overflow nor vanish there.
fn face(corners: [Vec3; 3]) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let cross = (b - a).cross(c - a);
    let length = cross.length();
    (length > 0.0 && length.is_finite()).then(|| (cross / length, length))
}

/// Angles of a triangle at its corners (rad).
fn angles(corners: [Vec3; 3], twice_area: f64) -> [f32; 3] {
    let p = corners.map(|p| p.as_dvec3());
    std::array::from_fn(|k| {
        let (b, c) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
        twice_area.atan2(b.dot(c)) as f32
    })
}

fn corners(scene: &Scene, triangle: [u32; 3]) -> [Vec3; 3] {
    triangle.map(|i| scene.position[i as usize])
}

/// Drops triangles without area, then vertices without a triangle. A mesh without normals stays without.
pub(crate) fn prune(scene: &mut Scene) {
    let position = &scene.position;
    let is_point = |p: [Vec3; 3]| p.iter().all(|p| p.is_finite()) && face(p).is_none();
    let is_kept = |t: &[u32; 3]| !is_point(t.map(|i| position[i as usize]));
    let mut triangles = scene.triangle.iter();
    scene.albedo.retain(|_| triangles.next().is_some_and(is_kept));
    let mut triangles = scene.triangle.iter();
    scene.textures.decal.retain(|_| triangles.next().is_some_and(is_kept));
    scene.triangle.retain(is_kept);
    let mut new_index = vec![u32::MAX; scene.position.len()];
    scene.triangle.as_flattened().iter().for_each(|&i| new_index[i as usize] = 0);
    new_index.iter_mut().filter(|i| **i == 0).zip(0..).for_each(|(index, new)| *index = new);
    let mut kept = new_index.iter().map(|&i| i != u32::MAX);
    scene.position.retain(|_| kept.next().unwrap_or(false));
    let mut kept = new_index.iter().map(|&i| i != u32::MAX);
    scene.normal.retain(|_| kept.next().unwrap_or(false));
    scene.triangle.as_flattened_mut().iter_mut().for_each(|i| *i = new_index[*i as usize]);
}

/// Makes every normal a unit vector; one without a direction becomes the mean of the faces around its vertex,
/// weighted by their angles there. Expects a mesh without degenerate triangles.
pub(crate) fn repair(scene: &mut Scene) {
    let unit = |n: Vec3| n.as_dvec3().normalize_or_zero().as_vec3();
    scene.normal.iter_mut().for_each(|n| *n = unit(*n));
    if scene.normal.iter().all(|n| *n != Vec3::ZERO) {
        return;
    }
    let mut sum = vec![DVec3::ZERO; scene.position.len()];
    let mut any = vec![DVec3::Y; scene.position.len()];
    for &triangle in &scene.triangle {
        let Some((normal, twice_area)) = face(corners(scene, triangle)) else { continue };
        for (i, angle) in triangle.into_iter().zip(angles(corners(scene, triangle), twice_area)) {
            sum[i as usize] += normal * f64::from(angle);
            any[i as usize] = normal;
        }
    }
    for (n, (sum, any)) in scene.normal.iter_mut().zip(sum.into_iter().zip(any)) {
        if *n == Vec3::ZERO {
            // Faces that cancel leave only rounding errors.
            *n = if sum.length() > 1e-6 { sum.normalize() } else { any }.as_vec3();
        }
    }
}

/// Faces at a point beyond which each keeps its own normal: bounds the pairs that are compared.
// guess: above any pole of a finely divided sphere.
const MAX_FACES_AT_A_POINT: usize = 1024;

/// Replaces the vertices: equal positions with equal normals become one, others are split.
/// Expects a mesh without degenerate triangles.
pub(crate) fn generate(scene: &mut Scene, missing: MissingNormals) {
    let around = Around::new(scene);
    let faces: Vec<Face> = scene.triangle.iter().map(|&t| Face::new(corners(scene, t))).collect();
    let mut position = Vec::new();
    let mut normal: Vec<Vec3> = Vec::new();
    let mut triangle = scene.triangle.clone();
    for (point, at) in around.point.iter().enumerate() {
        let fan = &around.corner[around.start[point]..around.start[point + 1]];
        let mut split: Vec<(Vec3, usize)> = match missing {
            MissingNormals::Crease { angle_deg } if fan.len() <= MAX_FACES_AT_A_POINT => {
                let least = angle_deg.to_radians().cos() - 1e-6;
                fan.iter().map(|&corner| (smooth(&faces, fan, corner, least), corner)).collect()
            }
            MissingNormals::Crease { .. } | MissingNormals::Flat => {
                fan.iter().map(|&corner| (faces[corner / 3].normal, corner)).collect()
            }
        };
        split.sort_by_key(|(n, _)| n.to_array().map(f32::to_bits));
        let first = normal.len();
        for (n, corner) in split {
            if normal[first..].last() != Some(&n) {
                position.push(*at);
                normal.push(n);
            }
            triangle[corner / 3][corner % 3] = normal.len() as u32 - 1;
        }
    }
    (scene.position, scene.normal, scene.triangle) = (position, normal, triangle);
}

struct Face {
    normal: Vec3,
    angles: [f32; 3],
}

impl Face {
    fn new(corners: [Vec3; 3]) -> Self {
        let (normal, twice_area) = face(corners).unwrap_or((DVec3::Y, 0.0));
        Self { normal: normal.as_vec3(), angles: angles(corners, twice_area) }
    }
}

/// Mean of the faces of a fan that bend less than the crease angle away from the face of `corner`, weighted by
/// their angles at the point. Thürmer and Wüthrich 1998.
fn smooth(faces: &[Face], fan: &[usize], corner: usize, least_cosine: f32) -> Vec3 {
    let own = faces[corner / 3].normal;
    let near = fan.iter().filter(|&&other| faces[other / 3].normal.dot(own) >= least_cosine);
    let sum: Vec3 = near.map(|&other| faces[other / 3].normal * faces[other / 3].angles[other % 3]).sum();
    if sum.length() > 1e-6 { sum.normalize() } else { own }
}

/// The triangle corners at each distinct position. Corner `3 t + k` is corner `k` of triangle `t`.
struct Around {
    point: Vec<Vec3>,
    start: Vec<usize>,
    corner: Vec<usize>,
}

impl Around {
    fn new(scene: &Scene) -> Self {
        let mut known = HashMap::with_capacity(scene.position.len());
        let mut point = Vec::new();
        let mut point_of = Vec::with_capacity(scene.position.len());
        for p in &scene.position {
            // Adding zero makes -0 and 0 equal.
            let index = *known.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                point.push(*p);
                point.len() - 1
            });
            point_of.push(index);
        }
        let mut start = vec![0; point.len() + 1];
        let points: Vec<usize> =
            scene.triangle.as_flattened().iter().map(|&i| point_of[i as usize]).collect();
        points.iter().for_each(|&p| start[p + 1] += 1);
        (0..point.len()).for_each(|p| start[p + 1] += start[p]);
        let mut next = start.clone();
        let mut corner = vec![0; points.len()];
        for (c, p) in points.into_iter().enumerate() {
            corner[next[p]] = c;
            next[p] += 1;
        }
        Self { point, start, corner }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn mesh(position: Vec<Vec3>, triangle: Vec<[u32; 3]>) -> Scene {
        Scene { position, triangle, ..Scene::default() }
    }

    /// The cube from -1 to 1, two triangles a side, eight vertices.
    fn cube() -> Scene {
        let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
        let position = (0..8).map(|i| Vec3::new(sign(i & 1), sign(i & 2), sign(i & 4))).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        mesh(position, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    /// The side of a prism with its vertices doubled, as separate quads have them.
    fn prism(sides: usize) -> Scene {
        let at = |i: usize| {
            let angle = TAU * (i % sides) as f32 / sides as f32;
            Vec3::new(angle.cos(), 0.0, -angle.sin())
        };
        let position =
            (0..sides).flat_map(|i| [at(i), at(i + 1), at(i + 1) + Vec3::Y, at(i) + Vec3::Y]).collect();
        let quad = |i: usize| [0, 1, 2, 0, 2, 3].map(|k| 4 * i as u32 + k);
        mesh(position, (0..sides).flat_map(|i| quad(i).as_chunks().0.to_vec()).collect())
    }

    fn generated(mut scene: Scene, missing: MissingNormals) -> Scene {
        generate(&mut scene, missing);
        scene.checked().unwrap()
    }

    #[test]
    fn a_cube_is_flat_until_the_crease_angle_passes_a_right_angle() {
        for missing in
            [MissingNormals::Flat, MissingNormals::CREASE, MissingNormals::Crease { angle_deg: 89.0 }]
        {
            let scene = generated(cube(), missing);
            assert_eq!((scene.position.len(), scene.triangle.len()), (24, 12));
            for (p, n) in scene.position.iter().zip(&scene.normal) {
                // The outward axis: of the position's coordinates, all of length one, the normal picks one.
                assert!(
                    (p.dot(*n) - 1.0).abs() < 1e-6 && n.max_element().max(-n.min_element()) > 0.999,
                    "{p} {n}"
                );
            }
        }
        // Weighted by angles a corner does not notice how its quads are cut: its normal is the diagonal.
        let scene = generated(cube(), MissingNormals::Crease { angle_deg: 91.0 });
        assert_eq!(scene.position.len(), 8);
        for (p, n) in scene.position.iter().zip(&scene.normal) {
            assert!(n.abs_diff_eq(p.normalize(), 1e-6), "{p} {n}");
        }
    }

    #[test]
    fn a_prism_is_round_from_nine_sides_at_40_degrees() {
        for (sides, round) in [(8, false), (9, true), (10, true), (64, true)] {
            let scene = generated(prism(sides), MissingNormals::Crease { angle_deg: 40.1 });
            assert_eq!(scene.position.len(), if round { 2 * sides } else { 4 * sides }, "{sides}");
            for (p, n) in scene.position.iter().zip(&scene.normal) {
                let outward = p.with_y(0.0).dot(*n);
                let expected = if round { 1.0 } else { (TAU / sides as f32 / 2.0).cos() };
                assert!((outward - expected).abs() < 1e-5, "{sides}: {outward}");
            }
        }
    }

    #[test]
    fn faces_that_cancel_keep_their_own_normal() {
        let position = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
        let both = mesh(position, vec![[0, 1, 2], [0, 2, 1]]);
        let scene = generated(both, MissingNormals::Crease { angle_deg: 180.0 });
        for (t, up) in scene.triangle.iter().zip([Vec3::Y, -Vec3::Y]) {
            assert!(t.iter().all(|&i| scene.normal[i as usize] == up), "{scene:?}");
        }
    }

    #[test]
    fn lost_normals_are_the_mean_of_the_faces_around() {
        let mut scene = cube();
        scene.normal = vec![Vec3::ZERO; 8];
        scene.normal[3] = Vec3::Y * 3.0;
        repair(&mut scene);
        for (i, (p, n)) in scene.position.iter().zip(&scene.normal).enumerate() {
            let expected = if i == 3 { Vec3::Y } else { p.normalize() };
            assert!(n.abs_diff_eq(expected, 1e-6), "{p} {n}");
        }
    }

    #[test]
    fn huge_and_tiny_triangles_have_normals() {
        for size in [1e-38, 1e-20, 1e20, 1e38] {
            let mut scene =
                mesh(vec![Vec3::ZERO, Vec3::Z * size, Vec3::X * size, Vec3::Z * 2.0 * size], vec![[0, 1, 2]]);
            scene.triangle.push([0, 1, 3]);
            prune(&mut scene);
            assert_eq!((scene.position.len(), scene.triangle.len()), (3, 1), "{size}");
            let scene = generated(scene, MissingNormals::CREASE);
            assert!(scene.normal.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{scene:?}");
        }
    }
}
