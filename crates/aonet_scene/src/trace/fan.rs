//! Rays that share their origin, up to 64 at once: each node and leaf is moved to the origin once for all of them.
// The idea of ray streams (Barringer and Akenine-Möller 2014), with a bit a ray in place of lists.
#![allow(unsafe_code, reason = "vector instructions")]

use super::build::{Bvh8, LEAF, Leaf, Node, STACK};
use super::lanes::{Lanes, Row, WIDTH};
use super::traverse::occluded_from;
use super::vector::Vector;
use glam::Vec3A;

/// Rays of a [`Fan`].
pub const FAN: usize = 64;

/// Rays of one length from one point, all of them above a plane through it.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub struct Fan {
    /// x, y and z of each ray's direction.
    direction: [[f32; FAN]; 3],
    origin: Vec3A,
    normal: Vec3A,
    length: f32,
    /// Bit `i` is set if ray `i` is used.
    pub rays: u64,
}

impl Fan {
    /// A fan without rays. They will start at `origin` on a plane with `normal` and be as long as `length` directions.
    pub fn new(origin: Vec3A, normal: Vec3A, length: f32) -> Self {
        Self { direction: [[0.0; FAN]; 3], origin, normal, length, rays: 0 }
    }

    /// Sets ray `i` unless its direction is below the plane.
    ///
    /// # Panics
    /// When `i` is not below [`FAN`].
    #[inline]
    pub fn set(&mut self, i: usize, direction: Vec3A) {
        for axis in 0..3 {
            self.direction[axis][i] = direction[axis];
        }
        self.rays |= u64::from(direction.dot(self.normal) > 0.0) << i;
    }

    /// Origin, direction and length of ray `i`.
    #[inline(always)]
    pub(super) fn single(&self, i: usize) -> (Vec3A, Vec3A, f32) {
        (self.origin, self.direction(i), self.length)
    }

    #[inline(always)]
    fn direction(&self, i: usize) -> Vec3A {
        Vec3A::new(self.direction[0][i], self.direction[1][i], self.direction[2][i])
    }
}

/// Below this many rays at a node, each ray continues alone. That is up to 13 % faster, measured by the `embree`
/// benchmark; 2 to 6 give equal times.
const FEW: u32 = 3;

/// A fan with values for the box test.
struct Prepared<'a, L> {
    fan: &'a Fan,
    inverse: [[f32; FAN]; 3],
    origin: Vector<L>,
    normal: Vector<L>,
    length: L,
}

/// The largest error of the box test relative to the distances it compares: four roundings, twice for safety.
const BOX_ERROR: f32 = 4.0 * f32::EPSILON;

/// The rays of `fan` that meet a triangle at 0 < t <= `length`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub(super) unsafe fn blocked<L: Lanes>(bvh: &Bvh8, fan: &Fan) -> u64 {
    // SAFETY: the caller's contract.
    unsafe {
        let fan = Prepared::<L>::new(fan);
        let mut open = fan.fan.rays;
        let mut stack = [(0u32, 0u64); STACK];
        stack[0] = (0, open);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (word, rays) = stack[top];
            let rays = rays & open;
            if rays == 0 {
                continue;
            }
            if word & LEAF != 0 {
                open &= !fan.hits(&bvh.leaves[(word & !LEAF) as usize], rays);
            } else if rays.count_ones() < FEW {
                open &= !fan.alone(bvh, word, rays);
            } else {
                let node = &bvh.nodes[word as usize];
                let (mut children, below) = fan.meets(node, rays);
                while children != 0 {
                    let k = children.trailing_zeros() as usize;
                    stack[top] = (node.child[k], below[k]);
                    top += 1;
                    children &= children - 1;
                }
            }
        }
        fan.fan.rays & !open
    }
}

fn reciprocals(direction: &[[f32; FAN]; 3]) -> [[f32; FAN]; 3] {
    let mut inverse = *direction;
    for x in inverse.as_flattened_mut() {
        *x = 1.0 / *x;
    }
    inverse
}

impl<'a, L: Lanes> Prepared<'a, L> {
    #[inline(always)]
    unsafe fn new(fan: &'a Fan) -> Self {
        // SAFETY: the caller's contract.
        unsafe {
            Self {
                fan,
                inverse: reciprocals(&fan.direction),
                origin: Vector::splat(fan.origin),
                normal: Vector::splat(fan.normal),
                length: L::splat(fan.length),
            }
        }
    }

    /// The children that any ray meets, and the rays that meet each.
    #[inline(always)]
    unsafe fn meets(&self, node: &Node, rays: u64) -> (u32, [u64; WIDTH]) {
        // SAFETY: the caller's contract.
        unsafe {
            let wider = L::splat(1.0 + BOX_ERROR);
            let mut near = [Row([0.0; WIDTH]); 6];
            let mut far = near;
            let mut height = L::splat(0.0);
            for axis in 0..3 {
                let origin = L::splat(self.fan.origin[axis]);
                let lo = L::load(&node.bounds[2 * axis]).sub(origin);
                let hi = L::load(&node.bounds[2 * axis + 1]).sub(origin);
                near[2 * axis] = lo.store();
                near[2 * axis + 1] = hi.store();
                far[2 * axis] = hi.mul(wider).store();
                far[2 * axis + 1] = lo.mul(wider).store();
                let top = if self.fan.normal[axis] < 0.0 { lo } else { hi };
                height = top.mul_add(L::splat(self.fan.normal[axis]), height);
            }
            let above = L::bits(L::splat(0.0).lt(height));
            if above == 0 {
                return (0, [0; WIDTH]);
            }
            let mut met = [0u8; FAN];
            let mut any = 0;
            let mut left = rays;
            while left != 0 {
                let ray = left.trailing_zeros() as usize;
                left &= left - 1;
                let (mut enter, mut leave) = (L::splat(0.0), self.length);
                for axis in 0..3 {
                    let inverse = self.inverse[axis][ray];
                    let side = 2 * axis + usize::from(inverse.is_sign_negative());
                    let inverse = L::splat(inverse);
                    enter = L::load(&near[side]).mul(inverse).max(enter);
                    leave = L::load(&far[side]).mul(inverse).min(leave);
                }
                let bits = L::bits(enter.le(leave));
                met[ray] = bits as u8;
                any |= bits;
            }
            (any & above, L::transpose(&met))
        }
    }

    /// Those of `rays` that meet a triangle of `leaf`.
    // Möller and Trumbore 1997; the terms without the direction are common to all rays.
    #[inline(always)]
    unsafe fn hits(&self, leaf: &Leaf, rays: u64) -> u64 {
        // SAFETY: the caller's contract.
        unsafe {
            let (e1, e2, normal) =
                (Vector::load(&leaf.e1), Vector::load(&leaf.e2), Vector::load(&leaf.normal));
            let c = Vector::load(&leaf.v0).sub(self.origin);
            let (zero, t) = (L::splat(0.0), normal.dot(c));
            let height = c.dot(self.normal);
            let highest = height.sub(e1.dot(self.normal)).max(height.add(e2.dot(self.normal))).max(height);
            let useful = L::bits(L::and(zero.lt(highest), zero.lt(t.abs())));
            if useful == 0 {
                return 0;
            }
            // A ray ahead of which the triangle lies has det of the sign of t: make both positive.
            let (normal, p, q) = (normal.xor_sign(t), c.cross(e2).xor_sign(t), c.cross(e1).xor_sign(t));
            let t = t.abs();
            let mut hit = 0;
            let mut left = rays;
            while left != 0 {
                let ray = left.trailing_zeros() as usize;
                left &= left - 1;
                let direction = Vector::splat(self.fan.direction(ray));
                let (det, u, v) = (normal.dot(direction), p.dot(direction), q.dot(direction));
                let inside = u.min(v).min(det.sub(u.add(v)));
                let inside = self.length.mul_sub(det, t).min(inside);
                if L::bits(zero.le(inside)) & useful != 0 {
                    hit |= 1 << ray;
                }
            }
            hit
        }
    }

    /// Those of `rays` that meet a triangle below node `word`, tested one after the other.
    #[inline(always)]
    unsafe fn alone(&self, bvh: &Bvh8, word: u32, rays: u64) -> u64 {
        // SAFETY: the caller's contract.
        unsafe {
            let mut hit = 0;
            let mut left = rays;
            while left != 0 {
                let ray = left.trailing_zeros() as usize;
                left &= left - 1;
                if occluded_from::<L>(bvh, word, self.fan.single(ray)) {
                    hit |= 1 << ray;
                }
            }
            hit
        }
    }
}
