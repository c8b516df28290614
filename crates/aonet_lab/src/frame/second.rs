//! The second layer of a frame from a file of its own.

use super::FrameHints;
use super::channels::SecondLayout;
use super::normals;
use crate::exr_file::ExrFile;
use aonet::{Error, GBuffer, Result, SecondLayer};

/// How far a depth may be in front of the first layer and still be the same surface, relative to its depth.
// guess: above the rounding of a camera with other planes, below the thickness of objects.
const ROUNDING: f32 = 1e-4;

/// The visible surfaces of a file, for a frame of which the camera's position in the world may be known. Normals in world space
/// are turned by that camera.
///
/// # Errors
/// When the file has no depth, is of another size than the frame, has normals of a wrong kind, or is broken.
pub(super) fn read(
    bytes: &[u8],
    (first, has_pose): (&GBuffer, bool),
    hints: &FrameHints,
) -> Result<SecondLayer<'static>> {
    let file = ExrFile::open(bytes)?;
    let window = first.window();
    if file.window() != window {
        return Err(Error::size("second layer", format!("{window}, as the first layer"), file.window()));
    }
    let layout = SecondLayout::find(file.channels())?;
    let space = hints.normals.unwrap_or(layout.space);
    let mut pixels = layout.read(file, window)?;
    for (depth, first) in pixels.depth.iter_mut().zip(first.depth()) {
        if *depth < *first && *depth >= (1.0 - ROUNDING) * first {
            *depth = *first;
        }
    }
    if let Some(normal) = &pixels.normal {
        normals::check_pose(space, has_pose)?;
        normals::check_not_encoded(normal, &pixels.depth)?;
    }
    let to_view = |normal| normals::to_view(normal, space, first.camera(), &pixels.depth);
    let normal = pixels.normal.map(to_view).map(Into::into);
    Ok(SecondLayer { depth: pixels.depth.into(), normal })
}
