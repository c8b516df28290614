//! Sample points around a pixel, turned by noise, and whether the depth buffer hides them.

use super::screen::{Pixels, Screen, Tap};
use crate::simd::Simd;
use crate::simd::lanes::{F, Mask};
use crate::simd::vector::V3;
use std::f32::consts::TAU;

/// Right-handed axes of every pixel; the third is given.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Basis<S: Simd> {
    x: V3<S>,
    y: V3<S>,
    z: V3<S>,
}

impl<S: Simd> Basis<S> {
    /// Axes about the unit vector `z`, turned by `turn` half turns.
    // Duff et al. 2017, Building an Orthonormal Basis, Revisited.
    #[inline(always)]
    pub(crate) fn about(z: V3<S>, turn: F<S>) -> Self {
        let sign = z.z.lt(0.0).select(-1.0, 1.0);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        let x = V3 { x: 1.0 + sign * z.x * z.x * a, y: sign * b, z: -(sign * z.x) };
        let y = V3 { x: b, y: sign + z.y * z.y * a, z: -z.y };
        let (c, s) = (turn * std::f32::consts::PI).cos_sin_of_half_turn();
        Self { x: x * c + y * s, y: y * c - x * s, z }
    }

    /// A direction of these axes in view space.
    #[inline(always)]
    pub(crate) fn to_view(self, [x, y, z]: [f32; 3]) -> V3<S> {
        self.x.mul_add(x, self.y.mul_add(y, self.z * z))
    }
}

/// A view-space sample point on the screen: what is seen there, and how far in front of the sample it is.
#[inline(always)]
pub(crate) fn look<S: Simd>(screen: &Screen<'_>, sample: V3<S>) -> (Tap<S>, F<S>) {
    let tap = screen.tap(screen.place(sample));
    (tap, tap.position.z - sample.z)
}

/// Whether a sample lies in the frame and in front of a perspective camera, where it has a place on the screen.
#[inline(always)]
pub(crate) fn on_screen<S: Simd>(p: &Pixels<S>, sample: V3<S>, tap: &Tap<S>) -> Mask<S> {
    // A sample nearer than a hundredth of the pixel's depth is as good as beside the camera.
    tap.inside & sample.z.lt(p.position.z * 0.01)
}

/// `count` unit directions of the hemisphere about +z: uniform, or weighted by the cosine.
// Points of a Fibonacci lattice; cosine weights by Malley's method.
pub(crate) fn directions(count: u32, cosine: bool) -> Vec<[f32; 3]> {
    let one = |i: u32| {
        let u = (i as f32 + 0.5) / count as f32;
        let z = if cosine { (1.0 - u).sqrt() } else { 1.0 - u };
        let (s, c) = (TAU * (i as f32 * 0.618_034).fract()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [c * r, s * r, z]
    };
    (0..count).map(one).collect()
}

/// Element `i` of the van der Corput sequence to base two, in (0, 1).
pub(crate) fn van_der_corput(i: u32) -> f32 {
    ((i + 1).reverse_bits() >> 8) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Portable;

    #[test]
    fn axes_are_orthonormal_and_right_handed() {
        for z in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.48, -0.6, 0.64], [-0.8, 0.6, 0.0]] {
            let z = V3::new(Portable, z);
            let b = Basis::about(z, F::new(Portable, 0.3));
            let close = |found: F<_>, expected: f32| assert!((found.array()[3] - expected).abs() < 1e-5);
            close(b.x.dot(b.y), 0.0);
            close(b.x.dot(b.z), 0.0);
            close(b.y.dot(b.y), 1.0);
            close(b.x.cross(b.y).dot(b.z), 1.0);
            close(b.to_view([0.0, 0.0, 2.0]).dot(z), 2.0);
        }
    }

    #[test]
    fn directions_have_the_mean_of_their_density() {
        for (cosine, mean) in [(false, 0.5), (true, 2.0 / 3.0)] {
            let z: f32 = directions(256, cosine).iter().map(|d| d[2]).sum::<f32>() / 256.0;
            assert!((z - mean).abs() < 2e-3, "{cosine}: {z}");
        }
        let heights: f32 = (0..256).map(van_der_corput).sum::<f32>() / 256.0;
        assert!((heights - 0.5).abs() < 5e-3, "{heights}");
    }
}
