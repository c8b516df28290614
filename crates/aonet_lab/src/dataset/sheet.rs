//! Contact sheets: many frames of a dataset in one picture.

use super::manifest::Manifest;
use crate::frame::{Frame, FrameHints};
use crate::picture::{self, Caption};
use aonet_scene::error::{Error, Result};
use image::RgbImage;
use image::imageops::{replace, thumbnail};

/// Largest width of a panel (px).
const PANEL_WIDTH: u32 = 320;

/// Most frames of a sheet.
const MAX_COUNT: usize = 1000;

/// Up to `count` frames spread over a dataset, each as its normals above its AO, in rows of `columns`.
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
    let panel = |k: usize| {
        let entry = &manifest.frames[k * total / count];
        let frame = Frame::load(&manifest.path(entry), &FrameHints::default())?;
        let caption = format!("{} {} {}", entry.scene, entry.index, entry.split.name());
        Ok((stacked(&frame), Caption::new(caption)))
    };
    let panels = (0..count).map(panel).collect::<Result<Vec<_>>>()?;
    picture::sheet(&panels, columns.min(count))
}

/// Normals above AO, small.
fn stacked(frame: &Frame) -> RgbImage {
    let normals = picture::normals(&frame.gbuffer);
    let scale = f64::from(PANEL_WIDTH) / f64::from(normals.width());
    let small = |image: &RgbImage| {
        let side = |length: u32| ((f64::from(length) * scale.min(1.0)) as u32).max(1);
        thumbnail(image, side(image.width()), side(image.height()))
    };
    let top = small(&normals);
    let mut panel = RgbImage::new(top.width(), 2 * top.height());
    replace(&mut panel, &top, 0, 0);
    if let Some(ao) = &frame.ao {
        replace(&mut panel, &small(&picture::ao(ao)), 0, i64::from(top.height()));
    }
    panel
}
