//! Makes a frame from its three images.

use super::{Import, NormalCoding};
use crate::exr_file::{Channel, ExrFile};
use crate::frame::{Frame, channels};
use aonet::{AoImage, GBuffer, Size};
use aonet_scene::error::{Error, Result};
use aonet_scene::view::View;
use glam::Vec3;
use std::path::{Path, PathBuf};

/// Normals shorter than this are background: an average over an edge keeps at least this much of its length.
const MIN_LENGTH: f32 = 0.5;

/// Tolerance of a unit normal's length. guess: loose enough for half floats and 8-bit textures.
const UNIT_TOLERANCE: f32 = 0.05;

/// Tolerance of visibility outside [0, 1], which is clamped. guess: the overshoot of a renderer's filter.
const OVERSHOOT: f32 = 0.1;

/// Channels of an image.
struct Planes {
    size: Size,
    /// HxW values of each channel.
    values: Vec<Vec<f32>>,
    /// Depth from which on a pixel is background.
    far_away: f32,
}

/// Size of an image.
///
/// # Errors
/// When the file cannot be read or is not an image.
pub(super) fn size(path: &Path) -> Result<Size> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    Ok(ExrFile::open(&bytes).map_err(Error::in_file(path))?.size())
}

/// The frame of the files of normals, depth and AO, and the view that it has.
///
/// # Errors
/// As [`import`](super::import).
pub(super) fn read([normal, depth, ao]: &[PathBuf; 3], wanted: &Import) -> Result<(Frame, View)> {
    let three = |found: &[Channel]| channels::normal(found).map(Vec::from);
    let raw = planes(normal, (three, "three channels: R, G, B or normal.X, normal.Y, normal.Z"), 0.0)?;
    let size = raw.size;
    let mut distance = planes(depth, (channels::depth, "one channel, or R, G, B alike"), f32::INFINITY)?;
    let mut visibility = planes(ao, (channels::ao_alone, "one channel, or R, G, B alike"), 1.0)?;
    for (path, found) in [(depth, &distance), (ao, &visibility)] {
        if found.size != size {
            let expected = format!("{size} as in {}", normal.display());
            return Err(Error::file(path, expected, found.size));
        }
    }
    let mut distance_values = grey(&mut distance, depth)?;
    find_background(&mut distance_values, distance.far_away);
    let raw: Vec<Vec3> =
        (0..size.pixels()).map(|i| Vec3::from_array([0, 1, 2].map(|c| raw.values[c][i]))).collect();
    check_coding(&raw, &distance_values, wanted.rule.normals).map_err(Error::in_file(normal))?;
    let unit = unit_normals(&raw, &mut distance_values, wanted.rule.normals);
    if distance_values.iter().all(|d| *d == f32::INFINITY) {
        return Err(Error::file(depth, "a pixel with a depth and a normal", "background alone"));
    }
    let view = view(wanted, size);
    let camera = view.camera().map_err(Error::in_file(normal))?;
    let gbuffer = GBuffer::new(camera, distance_values, unit).map_err(Error::in_file(normal))?;
    let ao = visible(grey(&mut visibility, ao)?, &gbuffer).map_err(Error::in_file(ao))?;
    let frame = Frame {
        gbuffer,
        geo_normal: None,
        ao: Some(ao),
        radius: Some(wanted.radius),
        view: Some(view.clone()),
    };
    Ok((frame, view))
}

/// A camera at the origin that looks along -Z, because its position in the world is unknown.
fn view(wanted: &Import, size: Size) -> View {
    View {
        eye: [0.0; 3],
        target: [0.0, 0.0, -1.0],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: wanted.rule.fov_y_deg,
        ortho_height: None,
        width: size.width(),
        height: size.height(),
        near: 0.0,
        far: f32::INFINITY,
        radius: wanted.radius,
        margin: 0.0,
        separation: None,
    }
}

/// The channels that `find` chooses, `outside` where the file stores nothing.
fn planes(
    path: &Path,
    (find, expected): (impl Fn(&[Channel]) -> Option<Vec<Channel>>, &str),
    outside: f32,
) -> Result<Planes> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    let file = ExrFile::open(&bytes).map_err(Error::in_file(path))?;
    let Some(found) = find(file.channels()) else {
        return Err(Error::file(path, expected, channels::list(file.channels())));
    };
    let (size, far_away) = (file.size(), channels::far_away(&found[0]));
    let wanted: Vec<_> = found.into_iter().map(|channel| (channel, outside)).collect();
    let values = file.planes(&wanted).map_err(Error::in_file(path))?;
    Ok(Planes { size, values, far_away })
}

/// The only plane of an image, or the value of its equal planes.
fn grey(planes: &mut Planes, path: &Path) -> Result<Vec<f32>> {
    let first = std::mem::take(&mut planes.values[0]);
    for other in &planes.values[1..] {
        let differs = |(a, b): (&f32, &f32)| a.to_bits() != b.to_bits();
        if let Some(i) = first.iter().zip(other).position(differs) {
            let (x, y) = (i % planes.size.width(), i / planes.size.width());
            let found = format!("{} and {} at ({x}, {y})", first[i], other[i]);
            return Err(Error::file(path, "grey: R, G and B alike", found));
        }
    }
    Ok(first)
}

/// Makes distances positive, and infinite on the background.
fn find_background(distance: &mut [f32], far_away: f32) {
    for d in distance {
        let positive = d.abs();
        *d = if positive > 0.0 && positive < far_away { positive } else { f32::INFINITY };
    }
}

fn decoded(raw: Vec3, coding: NormalCoding) -> Vec3 {
    match coding {
        NormalCoding::Encoded => 2.0 * raw - Vec3::ONE,
        NormalCoding::Plain => raw,
    }
}

/// Makes normals unit length, and zero on the background; the depth becomes infinite there, too.
fn unit_normals(raw: &[Vec3], distance: &mut [f32], coding: NormalCoding) -> Vec<[f32; 3]> {
    let unit = |(raw, d): (&Vec3, &mut f32)| {
        let normal = decoded(*raw, coding);
        let length = normal.length();
        if *raw == Vec3::ZERO || length < MIN_LENGTH {
            *d = f32::INFINITY;
        }
        if *d == f32::INFINITY { [0.0; 3] } else { (normal / length).to_array() }
    };
    raw.iter().zip(distance).map(unit).collect()
}

/// # Errors
/// When the lengths of the vectors show that they are stored in another way.
fn check_coding(raw: &[Vec3], distance: &[f32], coding: NormalCoding) -> aonet::Result<()> {
    let (other, stored, hint) = match coding {
        NormalCoding::Encoded => (NormalCoding::Plain, "colours, n/2 + 1/2", "vectors as they are, `plain`"),
        NormalCoding::Plain => {
            (NormalCoding::Encoded, "vectors as they are", "colours, n/2 + 1/2, `encoded`")
        }
    };
    let is_unit = |n: Vec3| (n.length() - 1.0).abs() < UNIT_TOLERANCE;
    let (mut seen, mut unit, mut fitting, mut others) = (0, 0, 0, 0);
    let foreground = raw.iter().zip(distance).filter(|(n, d)| **n != Vec3::ZERO && **d != f32::INFINITY);
    for (n, _) in foreground {
        let (own, elsewise) = (decoded(*n, coding), decoded(*n, other));
        if own.length() < MIN_LENGTH && !is_unit(elsewise) {
            continue;
        }
        seen += 1;
        unit += usize::from(is_unit(own));
        fitting += usize::from((MIN_LENGTH..1.0 + UNIT_TOLERANCE).contains(&own.length()));
        others += usize::from(is_unit(elsewise));
    }
    let found = if 2 * unit < seen && 10 * others > 9 * seen {
        hint.to_owned()
    } else if 2 * fitting < seen {
        format!("{} of {seen} that are then not of unit length", seen - fitting)
    } else {
        return Ok(());
    };
    Err(aonet::Error::value("normals", stored, found))
}

/// Visibility that is 1 on the background.
fn visible(mut values: Vec<f32>, gbuffer: &GBuffer) -> aonet::Result<AoImage> {
    let width = gbuffer.width();
    for (i, v) in values.iter_mut().enumerate() {
        if !gbuffer.is_foreground(i) {
            *v = 1.0;
        }
        if !(-OVERSHOOT..=1.0 + OVERSHOOT).contains(v) {
            let what = format!("visibility at ({}, {})", i % width, i / width);
            return Err(aonet::Error::value(what, "a number in [0, 1]", *v));
        }
    }
    AoImage::new(gbuffer.size(), values)
}
