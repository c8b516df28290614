//! Traces rays through a scene with an 8-wide bounding volume hierarchy.
#![allow(unsafe_code, reason = "entry points compiled for the instruction set that was found")]

mod build;
mod fan;
#[cfg(feature = "gpu")]
mod flat;
mod lanes;
mod sah;
mod traverse;
mod vector;

#[cfg(test)]
mod tests;

#[cfg(feature = "gpu")]
pub(crate) use build::MAX_DEPTH;
pub use fan::{FAN, Fan};
#[cfg(feature = "gpu")]
pub(crate) use flat::Flat;

use crate::Scene;
use build::Bvh8;
use glam::Vec3A;
use lanes::Scalar;

/// A scene with its hierarchy, ready for rays. Immutable; share it between threads.
#[derive(Debug)]
pub struct Tracer {
    scene: Scene,
    bvh: Bvh8,
    level: Level,
}

/// The nearest intersection of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray in lengths of its direction.
    pub t: f32,
    /// Index into [`Scene::triangle`].
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
}

/// Instruction set. All give the same hits, bit for bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Level {
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
        {
            return Self::Avx2;
        }
        Self::Scalar
    }
}

impl Tracer {
    /// Builds the hierarchy. Triangles with a vertex that is not finite are left out.
    ///
    /// # Panics
    /// When a triangle has an index that is out of range; [`Scene::checked`] refuses such scenes.
    pub fn new(scene: Scene) -> Self {
        Self { bvh: Bvh8::new(&scene), scene, level: Level::detect() }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The hierarchy for shaders.
    #[cfg(feature = "gpu")]
    pub(crate) fn flat(&self) -> crate::Result<Flat> {
        Flat::new(&self.bvh)
    }

    /// Whether any triangle lies at 0 < t <= `t_max` along the ray.
    #[inline]
    pub fn occluded(&self, origin: Vec3A, direction: Vec3A, t_max: f32) -> bool {
        // SAFETY: `Level::detect` found the instruction set.
        unsafe {
            match self.level {
                Level::Scalar => traverse::occluded_from::<Scalar>(&self.bvh, 0, (origin, direction, t_max)),
                #[cfg(target_arch = "x86_64")]
                Level::Avx2 => avx2::occluded(&self.bvh, origin, direction, t_max),
            }
        }
    }

    /// The rays of `fan` that meet a triangle at 0 < t <= its length: bit `i` for ray `i`.
    #[inline]
    pub fn blocked(&self, fan: &Fan) -> u64 {
        // SAFETY: `Level::detect` found the instruction set.
        unsafe {
            match self.level {
                Level::Scalar => fan::blocked::<Scalar>(&self.bvh, fan),
                #[cfg(target_arch = "x86_64")]
                Level::Avx2 => avx2::blocked(&self.bvh, fan),
            }
        }
    }

    /// The nearest triangle at 0 < t <= `t_max`.
    #[inline]
    pub fn closest(&self, origin: Vec3A, direction: Vec3A, t_max: f32) -> Option<Hit> {
        // SAFETY: `Level::detect` found the instruction set.
        unsafe {
            match self.level {
                Level::Scalar => traverse::closest::<Scalar>(&self.bvh, origin, direction, t_max),
                #[cfg(target_arch = "x86_64")]
                Level::Avx2 => avx2::closest(&self.bvh, origin, direction, t_max),
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::build::Bvh8;
    use super::lanes::Avx2;
    use super::{Fan, Hit, fan, traverse};
    use glam::Vec3A;

    #[target_feature(enable = "avx2,fma,bmi1")]
    pub(super) fn blocked(bvh: &Bvh8, rays: &Fan) -> u64 {
        // SAFETY: this function's target features.
        unsafe { fan::blocked::<Avx2>(bvh, rays) }
    }

    #[target_feature(enable = "avx2,fma,bmi1")]
    pub(super) fn occluded(bvh: &Bvh8, origin: Vec3A, direction: Vec3A, t_max: f32) -> bool {
        // SAFETY: this function's target features.
        unsafe { traverse::occluded_from::<Avx2>(bvh, 0, (origin, direction, t_max)) }
    }

    #[target_feature(enable = "avx2,fma,bmi1")]
    pub(super) fn closest(bvh: &Bvh8, origin: Vec3A, direction: Vec3A, t_max: f32) -> Option<Hit> {
        // SAFETY: this function's target features.
        unsafe { traverse::closest::<Avx2>(bvh, origin, direction, t_max) }
    }
}
