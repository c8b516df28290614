//! AO images alone: OpenEXR or PNG, by the file's extension.
//!
//! Values are linear visibility in [0, 1]: a PNG holds `round(65535 v)` as 16-bit grey, with no gamma.

use crate::exr_file::{ExrFile, Plane, encode_images};
use crate::frame::channels;
use crate::picture;
use aonet::search::{Share, Shares};
use aonet::{AoImage, Size};
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use aonet_scene::scene::textures::most_decoded_bytes;
use exr::prelude::FlatSamples;
use image::{ImageBuffer, ImageFormat, ImageReader, Limits, Luma};
use std::io::Cursor;
use std::path::Path;

/// The chunk at the end of every PNG: no data, its name, its checksum.
const PNG_END: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";

/// Memory that a PNG may take when it is decoded: 16-bit grey of the largest size, 32768 x 32768.
const MOST_BYTES: u64 = 1 << 31;

/// Writes `image` as `.exr` (channel `ao`, 32-bit) or `.png` (16-bit grey).
///
/// # Errors
/// When the extension is another one, or the file cannot be written; no partial file remains.
pub fn save_ao(path: &Path, image: &AoImage) -> Result<()> {
    let size = image.size();
    let bytes = match extension(path).as_str() {
        "exr" => {
            let plane = Plane { name: "ao", samples: FlatSamples::F32(image.visibility().to_vec()) };
            encode_images(size, vec![plane]).map_err(Error::in_file(path))?
        }
        "png" => {
            let grey =
                image.visibility().iter().map(|v| (v.clamp(0.0, 1.0) * 65535.0).round() as u16).collect();
            let buffer: ImageBuffer<Luma<u16>, Vec<u16>> =
                ImageBuffer::from_vec(size.width() as u32, size.height() as u32, grey)
                    .expect("one value a pixel");
            let mut bytes = Cursor::new(Vec::new());
            buffer.write_to(&mut bytes, ImageFormat::Png).map_err(|e| Error::file(path, "a PNG", e))?;
            bytes.into_inner()
        }
        other => return Err(unknown(path, other)),
    };
    atomic_file::write(path, &bytes)
}

/// Writes shares of light as `.exr` (a 32-bit channel a share, by [`Share::name`]) or `.png` (as [`picture::shares`] mixes them).
///
/// # Errors
/// When the extension is another one, or the file cannot be written; no partial file remains.
pub fn save_shares(path: &Path, shares: &Shares) -> Result<()> {
    match extension(path).as_str() {
        "exr" => {
            let plane = |share: Share| Plane {
                name: share.name(),
                samples: FlatSamples::F32(shares.plane(share).to_vec()),
            };
            let planes = Share::ALL.map(plane).into();
            let bytes = encode_images(shares.size(), planes).map_err(Error::in_file(path))?;
            atomic_file::write(path, &bytes)
        }
        "png" => picture::save_png(&picture::shares(shares), path),
        other => Err(unknown(path, other)),
    }
}

/// Reads an AO image: from an `.exr` the channel that [`Frame::load`](crate::frame::Frame::load) reads as AO, else
/// `Y`, `V` or `R`; from a `.png` the grey value.
///
/// # Errors
/// When the file is broken, or holds no such channel or a NaN.
pub fn load_ao(path: &Path) -> Result<AoImage> {
    read_ao(path, &std::fs::read(path).map_err(Error::io(path))?)
}

/// Reads an AO image from the contents of a file, whose extension says what they are.
///
/// # Errors
/// As [`load_ao`].
pub fn read_ao(path: &Path, bytes: &[u8]) -> Result<AoImage> {
    match extension(path).as_str() {
        "exr" => from_exr(bytes).map_err(Error::in_file(path)),
        "png" => from_png(path, bytes),
        other => Err(unknown(path, other)),
    }
}

fn from_exr(bytes: &[u8]) -> aonet::Result<AoImage> {
    let file = ExrFile::open(bytes)?;
    let size = file.size();
    let Some(channel) = channels::ao(file.channels()).cloned() else {
        let expected = "a channel ao, AO.R, LAYER.AO.R, …, or Y, V or R alone";
        return Err(aonet::Error::format("AO image", expected, channels::list(file.channels())));
    };
    let planes = file.planes(&[(channel, 1.0)])?;
    let values = planes.into_iter().next().unwrap_or_default();
    AoImage::new(size, values)
}

fn from_png(path: &Path, bytes: &[u8]) -> Result<AoImage> {
    let wrong = |e: image::ImageError| Error::file(path, "a PNG", e);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_alloc = Some(most_decoded_bytes(bytes.len()).min(MOST_BYTES));
    reader.limits(limits);
    let grey = reader.decode().map_err(wrong)?.into_luma16();
    // The decoder accepts a file with all pixels; a truncated file is refused as well.
    if !bytes.windows(PNG_END.len()).rev().any(|chunk| chunk == PNG_END) {
        return Err(Error::file(path, "a whole PNG", "no end of image"));
    }
    let values = grey.as_raw().iter().map(|v| f32::from(*v) / 65535.0).collect();
    let size = Size::new(grey.width() as usize, grey.height() as usize);
    size.and_then(|size| AoImage::new(size, values)).map_err(Error::in_file(path))
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn unknown(path: &Path, extension: &str) -> Error {
    Error::file(path, "the extension .exr or .png", format!("{extension:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> AoImage {
        AoImage::new(Size::px(7, 3), (0..21).map(|i| i as f32 / 20.0).collect()).unwrap()
    }

    #[test]
    fn both_formats_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        for (name, tolerance) in [("a.exr", 0.0), ("a.png", 1.0 / 65535.0)] {
            let path = dir.path().join(name);
            save_ao(&path, &ramp()).unwrap();
            let found = load_ao(&path).unwrap();
            for (a, b) in ramp().visibility().iter().zip(found.visibility()) {
                assert!((a - b).abs() <= tolerance, "{name}: {a} {b}");
            }
        }
    }

    #[test]
    fn a_pass_called_ao_is_found_and_a_normal_is_not_taken_for_it() {
        let file = |name| {
            let plane = Plane { name, samples: FlatSamples::F32(ramp().visibility().to_vec()) };
            encode_images(Size::px(7, 3), vec![plane]).unwrap()
        };
        for name in ["ao", "Y", "R", "AO.R", "ViewLayer.AO.R", "ViewLayer.Ambient Occlusion.R", "scene.ao"] {
            assert_eq!(from_exr(&file(name)).unwrap(), ramp(), "{name}");
        }
        for name in ["normal.Y", "Normal.R", "depth", "shadow_chao.R"] {
            assert!(from_exr(&file(name)).unwrap_err().to_string().contains(name), "{name}");
        }
    }

    #[test]
    fn a_png_of_one_bit_a_pixel_is_read_however_short_it_is() {
        // 1280 x 1280 pixels in 280 bytes.
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/one_bit.png");
        assert!(load_ao(&path).unwrap().visibility().iter().all(|v| *v == 0.0));
    }

    #[test]
    fn truncated_and_unknown_files_are_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.exr", "a.png"] {
            let path = dir.path().join(name);
            save_ao(&path, &ramp()).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            for end in [0, 4, bytes.len() / 2, bytes.len() - 5] {
                std::fs::write(&path, &bytes[..end]).unwrap();
                assert!(load_ao(&path).unwrap_err().to_string().contains(name));
            }
        }
        let error = save_ao(&dir.path().join("a.jpg"), &ramp()).unwrap_err().to_string();
        assert!(error.contains("a.jpg") && error.contains(".png"), "{error}");
    }
}
