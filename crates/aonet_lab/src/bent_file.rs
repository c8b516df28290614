//! Bent normals in files: as channels of an OpenEXR file, or as colours of a PNG.
//!
//! The channels are `bent_normal.X`, `bent_normal.Y` and `bent_normal.Z`: unit vectors in view space, zero on the background. A PNG
//! holds n/2 + 1/2 in 8 bits; its background is black.

use crate::exr_file::{ExrFile, Plane, encode_images};
use crate::frame::channels;
use crate::picture;
use aonet::{AoImage, BentNormals};
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use exr::prelude::FlatSamples;
use std::path::Path;

/// Names of the channels.
pub const CHANNELS: [&str; 3] = ["bent_normal.X", "bent_normal.Y", "bent_normal.Z"];

/// Writes bent normals alone, as `.exr` (32-bit) or `.png`.
///
/// # Errors
/// When the extension is another one, or the file cannot be written; no partial file remains.
pub fn save_bent_normals(path: &Path, bent: &BentNormals) -> Result<()> {
    match path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase().as_str() {
        "exr" => {
            let bytes = encode_images(bent.size(), planes(bent).into());
            atomic_file::write(path, &bytes.map_err(Error::in_file(path))?)
        }
        "png" => picture::save_png(&picture::bent_normals(bent), path),
        other => Err(Error::file(path, "the extension .exr or .png", format!("{other:?}"))),
    }
}

/// Writes visibility and bent normals of a picture as channels of one `.exr` (32-bit).
///
/// # Errors
/// When they have different sizes or the file cannot be written; no partial file remains.
pub fn save_ao_with_bent_normals(path: &Path, image: &AoImage, bent: &BentNormals) -> Result<()> {
    image.size().expect("bent normals of an AO image", bent.size())?;
    let ao = Plane { name: "ao", samples: FlatSamples::F32(image.visibility().to_vec()) };
    let all = planes(bent).into_iter().chain([ao]).collect();
    let bytes = encode_images(image.size(), all).map_err(Error::in_file(path))?;
    atomic_file::write(path, &bytes)
}

/// Reads the bent normals of the picture of an `.exr`.
///
/// # Errors
/// When the file is broken, lacks one of the channels, or a number is not finite.
pub fn load_bent_normals(path: &Path) -> Result<BentNormals> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    from_exr(&bytes).map_err(Error::in_file(path))
}

fn from_exr(bytes: &[u8]) -> aonet::Result<BentNormals> {
    let file = ExrFile::open(bytes)?;
    let (size, all) = (file.size(), file.channels());
    let mut wanted = Vec::new();
    for name in CHANNELS {
        let missing = || aonet::Error::format("bent normals", CHANNELS.join(", "), channels::list(all));
        wanted.push((all.iter().find(|channel| channel.name == name).ok_or_else(missing)?.clone(), 0.0));
    }
    let planes = file.planes(&wanted)?;
    let direction = |i: usize| [0, 1, 2].map(|c| planes[c][i]);
    BentNormals::new(size, (0..size.pixels()).map(direction).collect())
}

fn planes(bent: &BentNormals) -> [Plane; 3] {
    [0, 1, 2].map(|c| {
        let samples = bent.directions().iter().map(|direction| direction[c]).collect();
        Plane { name: CHANNELS[c], samples: FlatSamples::F32(samples) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::Size;

    fn bent() -> BentNormals {
        let one = |i: usize| if i == 3 { [0.0; 3] } else { [0.48, -0.64, 0.6] };
        BentNormals::new(Size::px(4, 2), (0..8).map(one).collect()).unwrap()
    }

    #[test]
    fn channels_round_trip_alone_and_beside_ao() {
        let dir = tempfile::tempdir().unwrap();
        let (alone, both) = (dir.path().join("bent.exr"), dir.path().join("both.exr"));
        let ao = AoImage::new(Size::px(4, 2), (0..8).map(|i| i as f32 / 7.0).collect()).unwrap();
        save_bent_normals(&alone, &bent()).unwrap();
        save_ao_with_bent_normals(&both, &ao, &bent()).unwrap();
        for path in [&alone, &both] {
            assert_eq!(load_bent_normals(path).unwrap(), bent());
        }
        assert_eq!(crate::ao_file::load_ao(&both).unwrap(), ao);
        assert!(save_ao_with_bent_normals(&both, &AoImage::open(Size::px(4, 1)), &bent()).is_err());
    }

    #[test]
    fn a_picture_shows_directions_and_a_black_background() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bent.png");
        save_bent_normals(&path, &bent()).unwrap();
        let found = image::open(&path).unwrap().into_rgb8();
        assert_eq!((found.get_pixel(0, 0).0, found.get_pixel(3, 0).0), ([189, 46, 204], [0; 3]));
    }

    #[test]
    fn files_without_them_are_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("ao.exr");
        crate::ao_file::save_ao(&path, &AoImage::open(Size::px(2, 2))).unwrap();
        let error = load_bent_normals(&path).unwrap_err().to_string();
        assert!(error.contains("bent_normal.X") && error.contains("ao.exr"), "{error}");
        let error = save_bent_normals(&dir.path().join("bent.jpg"), &bent()).unwrap_err().to_string();
        assert!(error.contains(".png"), "{error}");
    }
}
