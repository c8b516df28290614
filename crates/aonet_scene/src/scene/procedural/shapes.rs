//! Shape builders. All are centred on x = z = 0 and, unless said otherwise, stand on y = 0.

use super::mesh::{Mesh, turn};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{PI, TAU};

/// Crease angle (degrees) below which lathed and swept surfaces are shaded smooth. guess
pub(super) const CREASE: f32 = 40.0;

/// A box of `size` with sharp edges.
pub(super) fn cuboid(size: Vec3) -> Mesh {
    let h = size * 0.5;
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        vec3(h.x * sign(0), h.y * (sign(1) + 1.0), h.z * sign(2))
    };
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut mesh = Mesh::default();
    sides.iter().for_each(|side| mesh.push_quad(side.map(corner)));
    mesh.shade(0.0)
}

/// A box of `size` whose edges are cut by `bevel` and shaded round.
pub(super) fn block(size: Vec3, bevel: f32) -> Mesh {
    let h = size * 0.5;
    let bevel = bevel.min(h.min_element() * 0.9);
    let mut mesh = Mesh::default();
    // Vertex 3 * corner + axis lies on the face across that axis.
    for corner in 0..8usize {
        let sign = Vec3::from_array([0, 1, 2].map(|bit| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 }));
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let inset = (Vec3::ONE - axis) * bevel;
            mesh.position.push((h - inset) * sign + Vec3::Y * h.y);
            mesh.normal.push(axis * sign);
        }
    }
    let outward = |mesh: &mut Mesh, [a, b, c]: [usize; 3]| {
        let t = [a as u32, b as u32, c as u32];
        let out = mesh.normal[a] + mesh.normal[b] + mesh.normal[c];
        let flip = mesh.area_vector(t).dot(out) < 0.0;
        mesh.triangle.push(if flip { [t[0], t[2], t[1]] } else { t });
    };
    for axis in 0..3usize {
        let (u, v) = (1usize << ((axis + 1) % 3), 1usize << ((axis + 2) % 3));
        for side in [0, 1usize << axis] {
            let at = |c: usize| 3 * (side + c) + axis;
            outward(&mut mesh, [at(0), at(u), at(u + v)]);
            outward(&mut mesh, [at(0), at(u + v), at(v)]);
        }
        for edge in [0, u, v, u + v] {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let at = |end: usize, face: usize| 3 * (edge + (end << axis)) + face;
            outward(&mut mesh, [at(0, i), at(0, j), at(1, i)]);
            outward(&mut mesh, [at(1, i), at(0, j), at(1, j)]);
        }
    }
    (0..8).for_each(|c| outward(&mut mesh, [3 * c, 3 * c + 1, 3 * c + 2]));
    mesh
}

/// A sampled surface over [0, 1]²; its front is where d/du x d/dv points. Smooth below [`CREASE`].
pub(super) fn surface((nu, nv): (usize, usize), at: impl Fn(f32, f32) -> Vec3) -> Mesh {
    grid((nu, nv), at).shade(CREASE)
}

/// [`surface`] without its normals.
pub(super) fn grid((nu, nv): (usize, usize), at: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=nu {
        for j in 0..=nv {
            mesh.position.push(at(i as f32 / nu as f32, j as f32 / nv as f32));
            mesh.normal.push(Vec3::Y);
        }
    }
    let index = |i: usize, j: usize| (i * (nv + 1) + j) as u32;
    for i in 0..nu {
        for j in 0..nv {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangle.extend([[a, b, c], [a, c, d]]);
        }
    }
    let solid = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.position[i as usize]);
        a != b && b != c && c != a
    };
    mesh.triangle = mesh.triangle.iter().copied().filter(solid).collect();
    mesh
}

/// The profile of (radius, height) points turned about the y axis, from the bottom up on the outside.
pub(super) fn lathe(profile: &[Vec2], segments: usize) -> Mesh {
    lathe_with(profile, segments, CREASE)
}

/// [`lathe`] with a crease angle (degrees) of its own; 0 is faceted.
pub(super) fn lathe_with(profile: &[Vec2], segments: usize, crease: f32) -> Mesh {
    let last = (profile.len() - 1) as f32;
    let at = |u: f32, v: f32| {
        let p = profile[(u * last).round() as usize];
        let k = (v * segments as f32).round() as usize % segments;
        let t = turn(k as f32 / segments as f32 * TAU);
        vec3(p.x * t.x, p.y, p.x * t.y)
    };
    grid((profile.len() - 1, segments), at).shade(crease)
}

/// A smooth curve through `points` (Catmull-Rom), `steps` samples a span.
pub(super) fn curve(points: &[Vec2], steps: usize) -> Vec<Vec2> {
    let at = |i: isize| points[i.clamp(0, points.len() as isize - 1) as usize];
    let mut out = vec![points[0]];
    for i in 0..points.len() as isize - 1 {
        let [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
        for k in 1..=steps {
            let t = k as f32 / steps as f32;
            let p = 0.5
                * (2.0 * b
                    + (c - a) * t
                    + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
                    + (3.0 * b - a - 3.0 * c + d) * t * t * t);
            out.push(vec2(p.x.max(0.0), p.y));
        }
    }
    out
}

/// An upright cylinder or cone frustum of (bottom, top) radius, closed, with a small bevel.
pub(super) fn cylinder((bottom, top): (f32, f32), height: f32, segments: usize) -> Mesh {
    let bevel = 0.06 * bottom.max(top).min(height);
    let inner = |r: f32| (r - bevel).max(0.0);
    let profile = [
        vec2(0.0, 0.0),
        vec2(inner(bottom), 0.0),
        vec2(bottom, bevel.min(bottom)),
        vec2(top, height - bevel.min(top)),
        vec2(inner(top), height),
        vec2(0.0, height),
    ];
    lathe_with(&profile, segments, 50.0)
}

/// A ball of `radius` about the origin.
pub(super) fn ball(radius: f32, segments: usize) -> Mesh {
    let half = segments / 2;
    let arc = |i: usize| {
        let t = turn(i as f32 / half as f32 * PI);
        let r = if i == 0 || i == half { 0.0 } else { t.y };
        vec2(r, -t.x) * radius
    };
    let profile: Vec<Vec2> = (0..=half).map(arc).collect();
    lathe_with(&profile, segments, 89.0)
}

/// Segments of a ring and of its cross-section.
#[derive(Clone, Copy)]
pub(super) struct Segments {
    pub(super) around: usize,
    pub(super) across: usize,
}

/// A ring about the y axis, centred on the origin. `major` is its radius, `minor` that of its cross-section.
pub(super) fn torus(major: f32, minor: f32, segments: Segments) -> Mesh {
    let Segments { around, across } = segments;
    let ring = |i: usize| vec2(major, 0.0) + minor * turn((i % across) as f32 / across as f32 * TAU);
    let profile: Vec<Vec2> = (0..=across).map(ring).collect();
    lathe_with(&profile, around, 89.0)
}

/// A closed box-to-ball-to-star shape about the origin: half `size`, and exponents from 0 (box) over 1
/// (ball) to 2 (octahedron) along the meridians and around.
pub(super) fn superellipsoid(size: Vec3, (north, east): (f32, f32), segments: usize) -> Mesh {
    let power = |c: f32, e: f32| libm::copysignf(libm::powf(c.abs(), e), c);
    let half = segments / 2;
    let at = |u: f32, v: f32| {
        let i = (u * half as f32).round();
        let phi = (i / half as f32 - 0.5) * PI;
        let theta = ((v * segments as f32).round() % segments as f32) / segments as f32 * TAU;
        let (p, t) = (turn(phi), turn(theta));
        let ring = if i == 0.0 || i == half as f32 { 0.0 } else { power(p.x, north) };
        size * vec3(ring * power(t.x, east), power(p.y, north), ring * power(t.y, east))
    };
    grid((half, segments), at).shade(50.0)
}

/// A round tube along `path` with one radius a point, closed at both ends.
pub(super) fn tube(path: &[Vec3], radius: &[f32], sides: usize) -> Mesh {
    let n = path.len();
    let tangent = |i: usize| (path[(i + 1).min(n - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::Y);
    let mut right = tangent(0).any_orthonormal_vector();
    let mut rings = vec![vec![path[0]; sides + 1]];
    for i in 0..n {
        let t = tangent(i);
        right = (right - t * right.dot(t)).normalize_or(t.any_orthonormal_vector());
        let up = t.cross(right);
        let spoke = |k: usize| {
            let c = turn((k % sides) as f32 / sides as f32 * TAU);
            path[i] + radius[i] * (right * c.x + up * c.y)
        };
        rings.push((0..=sides).map(spoke).collect());
    }
    rings.push(vec![path[n - 1]; sides + 1]);
    let last = (rings.len() - 1) as f32;
    let at = |u: f32, v: f32| rings[(u * last).round() as usize][(v * sides as f32).round() as usize];
    flipped(grid((rings.len() - 1, sides), at)).shade(60.0)
}

/// The mesh inside out; normals are left to [`Mesh::shade`].
fn flipped(mut mesh: Mesh) -> Mesh {
    mesh.triangle.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// A cross-section swept along a level `path` with mitred corners: x of the counter-clockwise `section`
/// points to the right of the path, y up. Closed paths return to their first point.
pub(super) fn moulding(path: &[Vec3], section: &[Vec2], closed: bool) -> Mesh {
    let n = path.len();
    let step = |i: usize, j: usize| (path[j] - path[i]).normalize_or_zero();
    let frame = |i: usize| {
        let before = if i > 0 || closed { step((i + n - 1) % n, i) } else { Vec3::ZERO };
        let after = if i + 1 < n || closed { step(i, (i + 1) % n) } else { Vec3::ZERO };
        let along = (before + after).normalize_or(Vec3::X);
        let mitre = along.dot(if after == Vec3::ZERO { before } else { after }).max(0.2);
        along.cross(Vec3::Y) / mitre
    };
    let right: Vec<Vec3> = (0..n).map(frame).collect();
    let rings = if closed { n + 1 } else { n };
    let at = |u: f32, v: f32| {
        let i = (u * (rings - 1) as f32).round() as usize % n;
        let s = section[(v * section.len() as f32).round() as usize % section.len()];
        path[i] + right[i] * s.x + Vec3::Y * s.y
    };
    let mut mesh = grid((rings - 1, section.len()), at);
    if !closed {
        for [a, b, c] in triangulate(section) {
            let end = |i: usize, k: usize| path[i] + right[i] * section[k].x + Vec3::Y * section[k].y;
            mesh.push([end(0, a), end(0, b), end(0, c)]);
            mesh.push([end(n - 1, a), end(n - 1, c), end(n - 1, b)]);
        }
    }
    mesh.shade(35.0)
}

/// An `outline` in x, y extruded along z by `depth` about z = 0, edges cut by `bevel`.
pub(super) fn extrude(outline: &[Vec2], depth: f32, bevel: f32) -> Mesh {
    let n = outline.len();
    let area: f32 = (0..n).map(|k| outline[k].perp_dot(outline[(k + 1) % n])).sum();
    if area < 0.0 {
        return extrude(&outline.iter().rev().copied().collect::<Vec<_>>(), depth, bevel);
    }
    let small = if bevel > 0.0 { inset(outline, bevel) } else { outline.to_vec() };
    let h = 0.5 * depth;
    let rings: Vec<(&[Vec2], f32)> = if bevel > 0.0 {
        vec![(&small, -h), (outline, bevel - h), (outline, h - bevel), (&small, h)]
    } else {
        vec![(outline, -h), (outline, h)]
    };
    let at = |u: f32, v: f32| {
        let (ring, z) = rings[(u * (rings.len() - 1) as f32).round() as usize];
        ring[(v * n as f32).round() as usize % n].extend(z)
    };
    let mut mesh = flipped(grid((rings.len() - 1, n), at));
    for [a, b, c] in triangulate(&small) {
        mesh.push([small[a].extend(h), small[b].extend(h), small[c].extend(h)]);
        mesh.push([small[a].extend(-h), small[c].extend(-h), small[b].extend(-h)]);
    }
    mesh.shade(30.0)
}

/// The corners of a counter-clockwise outline moved inwards by `width`.
pub(super) fn inset(outline: &[Vec2], width: f32) -> Vec<Vec2> {
    let n = outline.len();
    let corner = |k: usize| {
        let before = (outline[k] - outline[(k + n - 1) % n]).normalize_or_zero();
        let after = (outline[(k + 1) % n] - outline[k]).normalize_or_zero();
        let inward = (before + after).normalize_or(after).perp();
        outline[k] + inward * (width / inward.dot(after.perp()).max(0.5))
    };
    (0..n).map(corner).collect()
}

/// A flat ring between two counter-clockwise outlines of equal length, `depth` thick along z about
/// z = 0, edges cut by `bevel`.
pub(super) fn ring(outer: &[Vec2], inner: &[Vec2], (depth, bevel): (f32, f32)) -> Mesh {
    let (n, h) = (outer.len(), 0.5 * depth);
    let corner = |k: usize, row: usize| {
        let (out, hole) = (outer[k % n], inner[k % n]);
        let across = (out - hole).normalize_or_zero() * bevel;
        match row % 8 {
            0 => (out - across).extend(-h),
            1 => out.extend(bevel - h),
            2 => out.extend(h - bevel),
            3 => (out - across).extend(h),
            4 => (hole + across).extend(h),
            5 => hole.extend(h - bevel),
            6 => hole.extend(bevel - h),
            _ => (hole + across).extend(-h),
        }
    };
    let at = |u: f32, v: f32| corner((u * n as f32).round() as usize, (v * 8.0).round() as usize);
    grid((n, 8), at).shade(30.0)
}

/// Ear clipping of a simple counter-clockwise polygon.
pub(super) fn triangulate(polygon: &[Vec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut out = Vec::with_capacity(left.len());
    let turn_left =
        |a: usize, b: usize, c: usize| (polygon[b] - polygon[a]).perp_dot(polygon[c] - polygon[b]);
    while left.len() > 3 {
        let n = left.len();
        let corner = |i: usize| (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
        let is_ear = |i: &usize| {
            let (a, b, c) = corner(*i);
            let inside = |&p: &usize| {
                turn_left(a, b, p) >= 0.0 && turn_left(b, c, p) >= 0.0 && turn_left(c, a, p) >= 0.0
            };
            turn_left(a, b, c) > 0.0 && !left.iter().any(|p| ![a, b, c].contains(p) && inside(p))
        };
        let ear = (0..n).find(is_ear).unwrap_or(0);
        let (a, b, c) = corner(ear);
        out.push([a, b, c]);
        left.remove(ear);
    }
    out.push([left[0], left[1], left[2]]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem, after a check that normals and winding agree.
    fn volume(mesh: &Mesh) -> f32 {
        let six = mesh.triangle.iter().map(|t| {
            let normal: Vec3 = t.iter().map(|&i| mesh.normal[i as usize]).sum();
            let face = mesh.area_vector(*t);
            assert!(face.dot(normal) >= 0.0 && face.length() > 0.0, "{t:?}: {face} {normal}");
            face.dot(mesh.position[t[0] as usize])
        });
        six.sum::<f32>() / 6.0
    }

    #[track_caller]
    fn assert_volume(mesh: &Mesh, expected: f32, tolerance: f32) {
        let found = volume(mesh);
        assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected}");
    }

    #[test]
    fn closed_shapes_have_their_volume_and_face_outwards() {
        assert_volume(&cuboid(vec3(1.0, 2.0, 3.0)), 6.0, 1e-5);
        assert_volume(&block(vec3(1.0, 2.0, 3.0), 1e-3), 6.0, 1e-4);
        assert_volume(&cylinder((1.0, 1.0), 2.0, 128), 2.0 * PI, 0.03);
        assert_volume(&ball(1.0, 128), 4.0 / 3.0 * PI, 0.01);
        assert_volume(&torus(1.0, 0.3, Segments { around: 128, across: 64 }), 2.0 * PI * PI * 0.09, 0.01);
        assert_volume(&superellipsoid(vec3(1.0, 2.0, 3.0), (1.0, 1.0), 128), 8.0 * PI, 0.01);
        let path = [Vec3::ZERO, vec3(0.0, 0.0, 4.0)];
        assert_volume(&tube(&path, &[0.5; 2], 64), PI, 0.01);
    }

    #[test]
    fn outlines_of_either_turn_are_extruded_and_ringed() {
        let ell =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)].map(|(x, y)| vec2(x, y));
        let mut backwards = ell;
        backwards.reverse();
        for outline in [ell, backwards] {
            assert_volume(&extrude(&outline, 0.5, 0.0), 2.0, 1e-4);
            assert_volume(&extrude(&outline, 0.5, 1e-3), 2.0, 5e-3);
        }
        let square = [vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0)];
        assert_volume(&ring(&square, &inset(&square, 0.5), (1.0, 0.001)), 3.0, 0.01);
    }

    #[test]
    fn mouldings_turn_corners() {
        let section = [vec2(0.0, 0.0), vec2(0.1, 0.0), vec2(0.1, 0.2), vec2(0.0, 0.2)];
        let around = [vec3(-1.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0), vec3(1.0, 0.0, -1.0), vec3(-1.0, 0.0, -1.0)];
        let outer = volume(&moulding(&around, &section, true)) / 0.2;
        let (bigger, smaller) = (2.2f32 * 2.2 - 4.0, 4.0 - 1.8f32 * 1.8);
        assert!((outer - bigger).abs() < 1e-3 || (outer - smaller).abs() < 1e-3, "{outer}");
        assert_volume(&moulding(&around[..2], &section, false), 0.04, 1e-3);
    }
}
