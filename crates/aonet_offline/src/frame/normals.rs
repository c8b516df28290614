//! Normals of other programs, brought to view space.

use aonet::{Camera, Error, Result};
use glam::Vec3A;

/// The space that the normals of a file are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NormalSpace {
    /// +X right, +Y up, +Z towards the camera.
    View,
    /// World space of glTF: right-handed, +Y up.
    World,
    /// World space of Blender: right-handed, +Z up. Its (x, y, z) is (x, z, -y) in glTF's.
    BlenderWorld,
}

/// HxW vectors of three planes.
pub(super) fn interleave([x, y, z]: [Vec<f32>; 3]) -> Vec<[f32; 3]> {
    x.iter().zip(&y).zip(&z).map(|((x, y), z)| [*x, *y, *z]).collect()
}

/// The same normals in view space; zero where `depth` is infinite.
///
/// Blender's are averages over the samples of a pixel, so they are brought back to unit length.
///
/// # Errors
/// When they look like colours, n * 0.5 + 0.5.
pub(super) fn to_view(
    mut normals: Vec<[f32; 3]>,
    space: NormalSpace,
    camera: &Camera,
    depth: &[f32],
) -> Result<Vec<[f32; 3]>> {
    check_not_encoded(&normals, depth)?;
    let rotation = camera.view_from_world.matrix3;
    for (n, d) in normals.iter_mut().zip(depth) {
        *n = match space {
            _ if *d == f32::INFINITY => [0.0; 3],
            NormalSpace::View => *n,
            NormalSpace::World => (rotation * Vec3A::from(*n)).to_array(),
            NormalSpace::BlenderWorld => {
                let mean = Vec3A::new(n[0], n[2], -n[1]);
                let unit = if mean.length() <= 1.0 { mean.normalize_or(mean) } else { mean };
                (rotation * unit).to_array()
            }
        };
    }
    Ok(normals)
}

fn check_not_encoded(normals: &[[f32; 3]], depth: &[f32]) -> Result<()> {
    let is_unit = |n: &[f32; 3]| (n.iter().map(|c| c * c).sum::<f32>().sqrt() - 1.0).abs() < 0.05;
    let is_encoded =
        |n: &[f32; 3]| n.iter().all(|c| (0.0..=1.0).contains(c)) && is_unit(&n.map(|c| 2.0 * c - 1.0));
    let foreground = || normals.iter().zip(depth).filter(|(_, d)| **d != f32::INFINITY).map(|(n, _)| n);
    let first_bad = foreground().any(|n| !is_unit(n));
    if first_bad && foreground().all(is_encoded) {
        let expected = "vectors with components in [-1, 1]";
        return Err(Error::value("normals", expected, "colours, n * 0.5 + 0.5: undo that with 2 * n - 1"));
    }
    Ok(())
}
