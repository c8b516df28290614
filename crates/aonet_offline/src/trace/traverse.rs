//! Rays through the hierarchy, once for all instruction sets.
#![allow(unsafe_code, reason = "vector instructions")]

use super::Hit;
use super::build::{Bvh8, LEAF, Leaf, Node, STACK};
use super::lanes::{Lanes, Row};
use glam::Vec3A;

/// A ray, each component in all lanes.
struct Ray<L> {
    origin: [L; 3],
    direction: [L; 3],
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
        let (o, d, i) = (origin.to_array(), direction.to_array(), inverse.to_array());
        let (near, far) = ((shift - slack).to_array(), (shift + slack).to_array());
        // SAFETY: the caller's contract.
        unsafe {
            Self {
                origin: o.map(|x| L::splat(x)),
                direction: d.map(|x| L::splat(x)),
                inverse: i.map(|x| L::splat(x)),
                shift: std::array::from_fn(|a| [L::splat(near[a]), L::splat(far[a])]),
                near: i.map(|x| usize::from(x.is_sign_negative())),
            }
        }
    }

    /// Which children the ray meets in [0, `t_max`], and where it enters them.
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

    /// Which triangles the ray meets in (0, `t_max`], with `u`, `v` and `t`, each times `|det|`.
    // Möller and Trumbore 1997, scaled by the determinant so that most rays need no division.
    #[inline(always)]
    unsafe fn hits(&self, leaf: &Leaf, t_max: L) -> (u32, [L; 4]) {
        // SAFETY: the caller's contract.
        unsafe {
            let load = |rows: &[Row; 3]| rows.each_ref().map(|r| L::load(r));
            let (v0, e1, e2, normal) = (load(&leaf.v0), load(&leaf.e1), load(&leaf.e2), load(&leaf.normal));
            let c = [0, 1, 2].map(|a| v0[a].sub(self.origin[a]));
            let r = cross(self.direction, c);
            let det = dot(normal, self.direction);
            let (u, v, t) =
                (dot(r, e2).xor_sign(det), dot(r, e1).xor_sign(det), dot(normal, c).xor_sign(det));
            let (zero, det) = (L::splat(0.0), det.abs());
            let inside = L::and(L::and(zero.le(u), zero.le(v)), u.add(v).le(det));
            let ahead = L::and(zero.lt(t), t.le(t_max.mul(det)));
            (L::bits(L::and(inside, ahead)), [u, v, t, det])
        }
    }
}

#[inline(always)]
unsafe fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    // SAFETY: the caller's contract.
    unsafe { a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul(b[2]))) }
}

#[inline(always)]
unsafe fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    // SAFETY: the caller's contract.
    unsafe {
        let minor = |i: usize, j: usize| a[i].mul_sub(b[j], a[j].mul(b[i]));
        [minor(1, 2), minor(2, 0), minor(0, 1)]
    }
}

/// Whether any triangle lies at 0 < t <= `t_max`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub(super) unsafe fn occluded<L: Lanes>(bvh: &Bvh8, origin: Vec3A, direction: Vec3A, t_max: f32) -> bool {
    // SAFETY: the caller's contract.
    unsafe {
        let ray = Ray::<L>::new(origin, direction);
        let t_max = L::splat(t_max);
        let mut stack = [0u32; STACK];
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
                let [u, v, t] = [u, v, t].map(|x| x.div(det).store().0);
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
