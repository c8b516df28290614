//! Contact sheets: many frames of a dataset in one picture, for the eye.

use super::manifest::Manifest;
use crate::error::{Error, Result};
use crate::frame::{Frame, FrameHints};
use image::{Rgb, RgbImage};
use std::path::Path;

/// Width of the picture of one frame [px].
const CELL: u32 = 320;

/// Space between pictures [px].
const GAP: u32 = 4;

/// Most frames of a sheet: a picture of 100 megapixels.
const MAX_COUNT: usize = 1000;

/// Up to `count` frames spread over a dataset, each as its normals (n/2 + 1/2) above its AO, in rows of `columns`.
///
/// # Errors
/// When the dataset has no frames, a frame cannot be read, or `count` or `columns` is out of range.
pub fn contact_sheet(manifest: &Manifest, count: usize, columns: usize) -> Result<RgbImage> {
    let total = manifest.frames.len();
    let count = count.min(total);
    if !(1..=MAX_COUNT).contains(&count) || columns == 0 {
        let expected = format!("1 to {MAX_COUNT} frames and at least one column");
        return Err(Error::request("contact sheet", expected, format!("{count} frames, {columns} columns")));
    }
    let columns = columns.min(count) as u32;
    let recipe = &manifest.plan.recipe;
    let height =
        (u64::from(CELL) * recipe.height as u64 / recipe.width as u64).clamp(1, u64::from(CELL) * 4) as u32;
    let rows = (count as u32).div_ceil(columns);
    let mut sheet = RgbImage::new(columns * (CELL + GAP), rows * (2 * height + GAP));
    for k in 0..count {
        let entry = &manifest.frames[k * total / count];
        let frame = Frame::load(&manifest.path(entry), &FrameHints::default())?;
        let (x, y) = (k as u32 % columns * (CELL + GAP), k as u32 / columns * (2 * height + GAP));
        draw(&mut sheet, (x, y), height, &frame);
    }
    Ok(sheet)
}

fn draw(sheet: &mut RgbImage, (left, top): (u32, u32), height: u32, frame: &Frame) {
    let gbuffer = &frame.gbuffer;
    let byte = |v: f32| (v * 255.0 + 0.5) as u8;
    for y in 0..height {
        for x in 0..CELL {
            let fx = x as usize * gbuffer.width() / CELL as usize;
            let fy = y as usize * gbuffer.height() / height as usize;
            let i = fy * gbuffer.width() + fx;
            let normal = gbuffer.normal()[i].map(|c| byte(0.5 * c + 0.5));
            let open = frame.ao.as_ref().map_or(1.0, |ao| ao.visibility()[i]);
            sheet.put_pixel(left + x, top + y, Rgb(normal));
            sheet.put_pixel(left + x, top + height + y, Rgb([byte(open); 3]));
        }
    }
}

/// Writes a picture as PNG under a temporary name, then renames it.
///
/// # Errors
/// When it cannot be written.
pub fn save_png(picture: &RgbImage, path: &Path) -> Result<()> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|e| Error::file(path, "a picture that PNG can hold", e))?;
    crate::atomic_file::write(path, bytes.get_ref())
}
