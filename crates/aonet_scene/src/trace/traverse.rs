//! Traversal of the hierarchy, one source for all instruction sets.
#![allow(unsafe_code, reason = "vector instructions")]

use super::Hit;
use super::build::{Bvh8, LEAF, Leaf, Node, STACK};
use super::lanes::Lanes;
use super::vector::Vector;
use glam::Vec3A;

/// A ray, each component in all lanes.
struct Ray<L> {
    origin: Vector<L>,
    direction: Vector<L>,
    inverse: [L; 3],
    /// `-origin / direction`, moved outwards by the rounding of the box test: for near and far planes.
    shift: [[L; 2]; 3],
    /// Per axis, which of a box's two planes is the near one.
    near: [usize; 3],
}

/// A bound of the box test's rounding error, relative to the origin: three roundings, twice for safety.
const BOX_ERROR: f32 = 6.0 * f32::EPSILON;

impl<L: Lanes> Ray<L> {
    #[inline(always)]
    unsafe fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let inverse = direction.recip();
        let shift = -origin * inverse;
        let slack = (origin * inverse).abs() * BOX_ERROR;
        let (near, far) = (shift - slack, shift + slack);
        // SAFETY: the caller's contract.
        unsafe {
            Self {
                origin: Vector::splat(origin),
                direction: Vector::splat(direction),
                inverse: [L::splat(inverse.x), L::splat(inverse.y), L::splat(inverse.z)],
                shift: [
                    [L::splat(near.x), L::splat(far.x)],
                    [L::splat(near.y), L::splat(far.y)],
                    [L::splat(near.z), L::splat(far.z)],
                ],
                near: inverse.to_array().map(|x| usize::from(x.is_sign_negative())),
            }
        }
    }

    /// The children that the ray meets in [0, `t_max`], and where it enters them.
    #[inline(always)]
    unsafe fn meets(&self, node: &Node, t_max: L) -> (u32, L) {
        // SAFETY: the caller's contract.
        unsafe {
            let (mut enter, mut leave) = (L::splat(0.0), t_max);
            for axis in 0..3 {
                let near = L::load(&node.bounds[2 * axis + self.near[axis]]);
                let far = L::load(&node.bounds[2 * axis + 1 - self.near[axis]]);
                enter = near.mul_add(self.inverse[axis], self.shift[axis][0]).max(enter);
                leave = far.mul_add(self.inverse[axis], self.shift[axis][1]).min(leave);
            }
            (L::bits(enter.le(leave)), enter)
        }
    }

    /// The triangles that the ray meets in (0, `t_max`], with `u`, `v` and `t`, each times `|det|`.
    // Möller and Trumbore 1997, scaled by the determinant so that most rays need no division.
    #[inline(always)]
    unsafe fn hits(&self, leaf: &Leaf, t_max: L) -> (u32, [L; 4]) {
        // SAFETY: the caller's contract.
        unsafe {
            let (e1, e2, normal) =
                (Vector::load(&leaf.e1), Vector::load(&leaf.e2), Vector::load(&leaf.normal));
            let c = Vector::load(&leaf.v0).sub(self.origin);
            let r = self.direction.cross(c);
            let det = normal.dot(self.direction);
            let u = r.dot(e2).xor_sign(det);
            let v = r.dot(e1).xor_sign(det);
            let t = normal.dot(c).xor_sign(det);
            let (zero, det) = (L::splat(0.0), det.abs());
            let inside = L::and(L::and(zero.le(u), zero.le(v)), u.add(v).le(det));
            let ahead = L::and(zero.lt(t), t.le(t_max.mul(det)));
            (L::bits(L::and(inside, ahead)), [u, v, t, det])
        }
    }
}

/// Whether any triangle below node `root` lies at 0 < t <= `t_max`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub(super) unsafe fn occluded_from<L: Lanes>(
    bvh: &Bvh8,
    root: u32,
    (origin, direction, t_max): (Vec3A, Vec3A, f32),
) -> bool {
    // SAFETY: the caller's contract.
    unsafe {
        let ray = Ray::<L>::new(origin, direction);
        let t_max = L::splat(t_max);
        let mut stack = [root; STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let word = stack[top];
            if word & LEAF != 0 {
                if ray.hits(&bvh.leaves[(word & !LEAF) as usize], t_max).0 != 0 {
                    return true;
                }
                continue;
            }
            let node = &bvh.nodes[word as usize];
            let (mut met, _) = ray.meets(node, t_max);
            while met != 0 {
                stack[top] = node.child[met.trailing_zeros() as usize];
                top += 1;
                met &= met - 1;
            }
        }
        false
    }
}

/// The nearest triangle at 0 < t <= `t_max`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub(super) unsafe fn closest<L: Lanes>(
    bvh: &Bvh8,
    origin: Vec3A,
    direction: Vec3A,
    t_max: f32,
) -> Option<Hit> {
    // SAFETY: the caller's contract.
    unsafe {
        let ray = Ray::<L>::new(origin, direction);
        let (mut best, mut t_best) = (None, t_max);
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (enter, word) = stack[top];
            if enter > t_best {
                continue;
            }
            if word & LEAF != 0 {
                let leaf = &bvh.leaves[(word & !LEAF) as usize];
                let (mut met, [u, v, t, det]) = ray.hits(leaf, L::splat(t_best));
                if met == 0 {
                    continue;
                }
                let (u, v, t) = (u.div(det).store().0, v.div(det).store().0, t.div(det).store().0);
                while met != 0 {
                    let k = met.trailing_zeros() as usize;
                    if t[k] <= t_best && t[k] > 0.0 && (best.is_none() || t[k] < t_best) {
                        t_best = t[k];
                        best = Some(Hit { t: t[k], triangle: leaf.triangle[k], u: u[k], v: v[k] });
                    }
                    met &= met - 1;
                }
                continue;
            }
            let node = &bvh.nodes[word as usize];
            let (mut met, enter) = ray.meets(node, L::splat(t_best));
            let (base, enter) = (top, enter.store().0);
            while met != 0 {
                let k = met.trailing_zeros() as usize;
                let mut at = top;
                while at > base && stack[at - 1].0 < enter[k] {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (enter[k], node.child[k]);
                top += 1;
                met &= met - 1;
            }
        }
        best
    }
}
