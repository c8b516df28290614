//! Eight vectors at once.
#![allow(unsafe_code, reason = "vector instructions")]

use super::lanes::{Lanes, Row};
use glam::Vec3A;

/// x, y and z of eight vectors.
///
/// # Safety
/// As for [`Lanes`].
// Written out by component: closures would be compiled without the instruction set of `L`.
#[derive(Clone, Copy)]
pub(super) struct Vector<L> {
    pub(super) x: L,
    pub(super) y: L,
    pub(super) z: L,
}

#[allow(clippy::undocumented_unsafe_blocks, reason = "one contract for all, stated above")]
impl<L: Lanes> Vector<L> {
    #[inline(always)]
    pub(super) unsafe fn splat(v: Vec3A) -> Self {
        unsafe { Self { x: L::splat(v.x), y: L::splat(v.y), z: L::splat(v.z) } }
    }

    #[inline(always)]
    pub(super) unsafe fn load(rows: &[Row; 3]) -> Self {
        unsafe { Self { x: L::load(&rows[0]), y: L::load(&rows[1]), z: L::load(&rows[2]) } }
    }

    #[inline(always)]
    pub(super) unsafe fn sub(self, b: Self) -> Self {
        unsafe { Self { x: self.x.sub(b.x), y: self.y.sub(b.y), z: self.z.sub(b.z) } }
    }

    #[inline(always)]
    pub(super) unsafe fn xor_sign(self, sign: L) -> Self {
        unsafe { Self { x: self.x.xor_sign(sign), y: self.y.xor_sign(sign), z: self.z.xor_sign(sign) } }
    }

    #[inline(always)]
    pub(super) unsafe fn dot(self, b: Self) -> L {
        unsafe { self.x.mul_add(b.x, self.y.mul_add(b.y, self.z.mul(b.z))) }
    }

    #[inline(always)]
    pub(super) unsafe fn cross(self, b: Self) -> Self {
        unsafe {
            Self {
                x: self.y.mul_sub(b.z, self.z.mul(b.y)),
                y: self.z.mul_sub(b.x, self.x.mul(b.z)),
                z: self.x.mul_sub(b.y, self.y.mul(b.x)),
            }
        }
    }
}
