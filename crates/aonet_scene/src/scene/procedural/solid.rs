//! Solids given by a function: negative inside, about a distance near the surface.

use super::mesh::Mesh;
use glam::{Vec3, vec3};

/// Least smooth union of two fields: sharp at `k` = 0, rounded over about `k`.
pub(super) fn blend(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k.max(1e-6);
    a.min(b) - 0.25 * h * h * k
}

/// `a` without `b`, the cut rounded over about `k`.
pub(super) fn carve(a: f32, b: f32, k: f32) -> f32 {
    -blend(-a, b, k)
}

/// Distance to a segment thickened from radius `r.0` to `r.1`.
pub(super) fn capsule(p: Vec3, (a, b): (Vec3, Vec3), r: (f32, f32)) -> f32 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
    p.distance(a.lerp(b, t)) - (r.0 + (r.1 - r.0) * t)
}

/// About the distance to an ellipsoid of half axes `size` about the origin.
pub(super) fn ellipsoid(p: Vec3, size: Vec3) -> f32 {
    let (k0, k1) = ((p / size).length(), (p / (size * size)).length());
    k0 * (k0 - 1.0) / k1.max(1e-6)
}

/// Distance to a box of half `size` about the origin.
pub(super) fn cube(p: Vec3, size: Vec3) -> f32 {
    let q = p.abs() - size;
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0)
}

/// Corners along the side of a block that is skipped where its middle is far from the surface.
const BLOCK: usize = 4;

/// Largest slope of a field that [`isosurface`] takes. guess: distances have 1, noise on them adds
const STEEPEST: f32 = 2.0;

/// The surface field = 0 inside the box `lo`..`hi`, sampled with cubes of about `cell` and shaded smooth
/// below `crease` (degrees). It is open where the solid leaves the box.
// Naive surface nets: Gibson 1998.
pub(super) fn isosurface(
    (lo, hi): (Vec3, Vec3),
    cell: f32,
    crease: f32,
    field: impl Fn(Vec3) -> f32,
) -> Mesh {
    let n = ((hi - lo) / cell).ceil().max(Vec3::ONE);
    let step = (hi - lo) / n;
    let [nx, ny, nz] = n.to_array().map(|c| c as usize + 1);
    let corner = |i: usize, j: usize, k: usize| lo + step * vec3(i as f32, j as f32, k as f32);
    let index = |i: usize, j: usize, k: usize| (k * ny + j) * nx + i;
    let mut value = vec![0.0; nx * ny * nz];
    for (k, j, i) in cells([nz, ny, nx].map(|n| n.div_ceil(BLOCK))) {
        let first = [i, j, k].map(|b| b * BLOCK);
        let last = [(first[0], nx), (first[1], ny), (first[2], nz)].map(|(f, n)| (f + BLOCK).min(n));
        let half = step * (0.5 * BLOCK as f32);
        let middle = field(corner(first[0], first[1], first[2]) + half);
        let far = middle.abs() > STEEPEST * half.length();
        for (k, j, i) in cells([2, 1, 0].map(|a| last[a] - first[a])) {
            let [i, j, k] = [first[0] + i, first[1] + j, first[2] + k];
            value[index(i, j, k)] = if far { middle } else { field(corner(i, j, k)) };
        }
    }
    let mut mesh = Mesh::default();
    let mut vertex = vec![u32::MAX; value.len()];
    for (k, j, i) in cells([nz - 1, ny - 1, nx - 1]) {
        let Some(offset) = crossing(|c| value[index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))]) else {
            continue;
        };
        vertex[index(i, j, k)] = mesh.position.len() as u32;
        mesh.position.push(corner(i, j, k) + offset * step);
        mesh.normal.push(Vec3::Y);
    }
    let stride = [1, nx, nx * ny];
    for (k, j, i) in cells([nz - 1, ny - 1, nx - 1]) {
        let here = index(i, j, k);
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let inside = value[here] < 0.0;
            if [i, j, k][u] == 0 || [i, j, k][v] == 0 || inside == (value[here + stride[axis]] < 0.0) {
                continue;
            }
            let ring = [here, here - stride[u], here - stride[u] - stride[v], here - stride[v]];
            let [a, b, c, d] = ring.map(|i| vertex[i]);
            mesh.triangle.extend(if inside { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    mesh.shade(crease)
}

/// All (outer, middle, inner) indices below `n`.
fn cells(n: [usize; 3]) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n[0]).flat_map(move |k| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |i| (k, j, i))))
}

/// Mean of the points where the field changes sign on the edges of a unit cube; corner bits are x, y, z.
fn crossing(value: impl Fn(usize) -> f32) -> Option<Vec3> {
    let at = |c: usize| vec3((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32);
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    let corner: [f32; 8] = std::array::from_fn(value);
    for a in 0..8 {
        for b in [a | 1, a | 2, a | 4] {
            if a != b && (corner[a] < 0.0) != (corner[b] < 0.0) {
                sum += at(a).lerp(at(b), corner[a] / (corner[a] - corner[b]));
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_its_radius_volume_and_outward_faces() {
        let ball = isosurface((Vec3::splat(-1.3), Vec3::splat(1.3)), 0.08, 180.0, |p| p.length() - 1.0);
        assert!(ball.position.iter().all(|p| (p.length() - 1.0).abs() < 0.01));
        let volume: f32 =
            ball.triangle.iter().map(|t| ball.area_vector(*t).dot(ball.position[t[0] as usize]) / 6.0).sum();
        assert!((volume - 4.18879).abs() < 0.05, "{volume}");
        assert!(ball.position.iter().zip(&ball.normal).all(|(p, n)| p.dot(*n) > 0.999 * p.length()));
    }
}
