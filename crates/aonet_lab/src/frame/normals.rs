//! Converts normals of other programs to view space.

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

/// # Errors
/// When normals are in world space and the camera's position in the world is not known.
pub(super) fn check_pose(space: NormalSpace, has_pose: bool) -> Result<()> {
    if space == NormalSpace::View || has_pose {
        return Ok(());
    }
    let expected = "a view, because the file's normals are in world space";
    Err(Error::value("camera", expected, "none"))
}

/// The same normals in view space; zero where `depth` is infinite.
///
/// Blender's are averages over the samples of a pixel, so they are brought back to unit length.
pub(super) fn to_view(
    mut normals: Vec<[f32; 3]>,
    space: NormalSpace,
    camera: &Camera,
    depth: &[f32],
) -> Vec<[f32; 3]> {
    let rotation = camera.view_from_world().matrix3;
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
    normals
}

/// # Errors
/// Names the first pixel of the foreground whose vector is not finite.
pub(super) fn check_finite(normals: &[[f32; 3]], depth: &[f32], width: usize) -> Result<()> {
    let bad = |(n, d): (&[f32; 3], &f32)| *d != f32::INFINITY && !Vec3A::from(*n).is_finite();
    match normals.iter().zip(depth).position(bad) {
        Some(i) => {
            let what = format!("geometric normal at ({}, {})", i % width, i / width);
            Err(Error::value(what, "a unit vector", format!("{:?}", normals[i])))
        }
        None => Ok(()),
    }
}

/// # Errors
/// When the normals of the foreground are colours, n * 0.5 + 0.5; judged by some thousand pixels.
pub(super) fn check_not_encoded(normals: &[[f32; 3]], depth: &[f32]) -> Result<()> {
    let is_unit = |n: &[f32; 3]| (n.iter().map(|c| c * c).sum::<f32>().sqrt() - 1.0).abs() < 0.05;
    let is_colour =
        |n: &[f32; 3]| n.iter().all(|c| (0.0..=1.0).contains(c)) && is_unit(&n.map(|c| 2.0 * c - 1.0));
    let (mut seen, mut unit, mut colours) = (0, 0, 0);
    let foreground = normals.iter().zip(depth).filter(|(_, d)| **d != f32::INFINITY);
    for (n, _) in foreground.step_by(1 + normals.len() / 4096) {
        seen += 1;
        unit += usize::from(is_unit(n));
        colours += usize::from(is_colour(n));
    }
    if 2 * unit < seen && 10 * colours > 9 * seen {
        let expected = "vectors with components in [-1, 1]";
        return Err(Error::value("normals", expected, "colours, n * 0.5 + 0.5: undo that with 2 * n - 1"));
    }
    Ok(())
}
