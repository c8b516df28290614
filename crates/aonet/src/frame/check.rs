//! Checks of a frame's pixels.

use crate::error::{Error, Result};
use crate::frame::camera::Camera;
use crate::frame::size::Size;

/// How far a normal's length may be from 1. guess: loose enough for half floats and 8-bit textures.
const UNIT_TOLERANCE: f32 = 0.05;

/// How far the square of a normal's length may be from 1 in a frame that is used as it is. guess: some roundings.
const TIDY_TOLERANCE: f32 = 2e-6;

/// Share of the foreground whose normals may face away from the viewer. Interpolated shading normals
/// do so near silhouettes; a world-space buffer does so on about half of the pixels.
/// guess: between the two.
const MAX_BACKFACING: f32 = 0.35;

/// Pixels that are checked together, so that the compiler uses vectors.
const BLOCK: usize = 16;

/// Whether normals must face the viewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Facing {
    /// Most of them.
    Viewer,
    /// None of them.
    Any,
}

/// What a row of pixels holds.
#[derive(Debug, Default)]
struct Row {
    is_bad: bool,
    is_untidy: bool,
    foreground: u32,
    backfacing: u32,
}

/// Whether a layer can be used as it is: normals that are zero on the background and else of unit length but for
/// rounding. `name` comes before the words depth and normal in errors.
///
/// # Errors
/// When a length is wrong, a depth is not above zero, a normal is not of unit length, or too many face away.
pub(super) fn layer(
    name: &str,
    camera: &Camera,
    (depth, normal): (&[f32], &[[f32; 3]]),
    facing: Facing,
) -> Result<bool> {
    let pixels = camera.size().pixels();
    if depth.len() != pixels || normal.len() != pixels {
        let found = format!("{} and {}", depth.len(), normal.len());
        return Err(Error::size("G-buffer", format!("{pixels} values of {name}depth and normal"), found));
    }
    let (mut is_tidy, mut foreground, mut backfacing) = (true, 0u64, 0u64);
    let rows = depth.chunks_exact(camera.width()).zip(normal.chunks_exact(camera.width()));
    for (y, (depth, normal)) in rows.enumerate() {
        let row = row(camera, y, depth, normal);
        if row.is_bad {
            return Err(first_bad(name, y, depth, normal));
        }
        is_tidy &= !row.is_untidy;
        foreground += u64::from(row.foreground);
        backfacing += u64::from(row.backfacing);
    }
    if facing == Facing::Viewer && backfacing as f32 > MAX_BACKFACING * foreground as f32 {
        let found = format!("{backfacing} of {foreground} normals that face away from it");
        return Err(Error::value("normals", "view space: towards the viewer", found));
    }
    Ok(is_tidy)
}

fn row(camera: &Camera, y: usize, depth: &[f32], normal: &[[f32; 3]]) -> Row {
    let ([focal_x, focal_y], [centre_x, centre_y]) = (camera.focal_px(), camera.centre_px());
    // A pixel's ray goes through (slope_x * column - start_x, ray_y, -1); parallel rays go along -Z.
    let perspective = f32::from(u8::from(camera.is_perspective()));
    let slope_x = perspective / focal_x;
    let ray_y = perspective * (centre_y - (y as f32 + 0.5)) / focal_y;
    let mut row = Row::default();
    for (i, (depth, normal)) in depth.chunks(BLOCK).zip(normal.chunks(BLOCK)).enumerate() {
        let (mut d, mut n) = ([f32::INFINITY; BLOCK], [[0.0f32; BLOCK]; 3]);
        for (k, (depth, normal)) in depth.iter().zip(normal).enumerate() {
            d[k] = *depth;
            [n[0][k], n[1][k], n[2][k]] = *normal;
        }
        let start_x = slope_x * ((i * BLOCK) as f32 + 0.5 - centre_x);
        let (mut bad, mut untidy) = ([0u32; BLOCK], [0u32; BLOCK]);
        let (mut foreground, mut backfacing) = ([0u32; BLOCK], [0u32; BLOCK]);
        for k in 0..BLOCK {
            let (x, y, z) = (n[0][k], n[1][k], n[2][k]);
            let squared = x * x + y * y + z * z;
            let ray_x = slope_x * k as f32 + start_x;
            let away = x * ray_x + y * ray_y - z;
            let ray_squared = ray_x * ray_x + ray_y * ray_y + 1.0;
            let is_shown = u32::from(d[k] < f32::INFINITY);
            let off = (squared.sqrt() - 1.0).abs();
            bad[k] = u32::from(!(d[k] > 0.0)) | is_shown & u32::from(!(off <= UNIT_TOLERANCE));
            let uneven = u32::from((squared - 1.0).abs() > TIDY_TOLERANCE);
            untidy[k] = is_shown & uneven | (1 - is_shown) & u32::from(squared != 0.0);
            foreground[k] = is_shown;
            // The cosine between normal and ray is above 0.05.
            let turned = u32::from(away > 0.0) & u32::from(away * away > 0.0025 * squared * ray_squared);
            backfacing[k] = is_shown & turned;
        }
        row.is_bad |= bad.iter().any(|b| *b != 0);
        row.is_untidy |= untidy.iter().any(|b| *b != 0);
        row.foreground += foreground.iter().sum::<u32>();
        row.backfacing += backfacing.iter().sum::<u32>();
    }
    row
}

/// The error of the first pixel of row `y` that is bad.
fn first_bad(name: &str, y: usize, depth: &[f32], normal: &[[f32; 3]]) -> Error {
    for (x, (d, n)) in depth.iter().zip(normal).enumerate() {
        if !(*d > 0.0) {
            return Error::value(format!("{name}depth at ({x}, {y})"), "a distance > 0 or infinity", d);
        }
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        if *d < f32::INFINITY && !((length - 1.0).abs() <= UNIT_TOLERANCE) {
            let found = format!("{n:?} of length {length}");
            return Error::value(format!("{name}normal at ({x}, {y})"), "a unit vector", found);
        }
    }
    Error::value(format!("{name}row {y}"), "depths and unit vectors", "others")
}

/// Makes normals zero on the background and elsewhere of unit length.
pub(super) fn tidy(depth: &[f32], normal: &mut [[f32; 3]]) {
    for (d, n) in depth.iter().zip(normal) {
        if *d == f32::INFINITY {
            *n = [0.0; 3];
            continue;
        }
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        *n = n.map(|c| c / length);
    }
}

/// # Errors
/// When `second` is of another size, or in front of `first` somewhere.
pub(super) fn behind(size: Size, first: &[f32], second: &[f32]) -> Result<()> {
    if second.len() != size.pixels() {
        return Err(Error::size("second depth", size.pixels(), second.len()));
    }
    match first.iter().zip(second).position(|(first, second)| !(second >= first)) {
        Some(i) => {
            let what = format!("second depth at ({}, {})", i % size.width(), i / size.width());
            Err(Error::value(what, format!("at least the first depth, {}", first[i]), second[i]))
        }
        None => Ok(()),
    }
}
