//! `AonetFrame`, checked.
#![allow(unsafe_code, reason = "reads memory of a C program")]

use crate::abi::Frame;
use crate::arguments::matrix;
use crate::failure::{Failure, Result};
use crate::pixels::{Input, Output};
use aonet::frame::ClipDepth;
use aonet::glam::{Mat3A, Vec3A};
use aonet::{AoParams, Camera, GBuffer, SecondLayer, Window};

/// How far the square of a normal's length may be from 1 in a frame that is used as it is.
// As in `aonet::GBuffer`, which would otherwise make a copy.
const TIDY_TOLERANCE: f32 = 2e-6;

/// How far a normal's length may be from 1. `aonet::GBuffer` refuses others.
const UNIT_TOLERANCE: f32 = 0.05;

/// A frame's images, camera and radius.
pub(crate) struct Inputs<'a> {
    window: Window,
    camera: Camera,
    depth: Input<'a, 1>,
    normal: Input<'a, 3>,
    second: Option<Input<'a, 1>>,
    /// Rotation of normals, where they are in world space.
    view_from_world: Option<Mat3A>,
    pub(crate) params: AoParams,
}

/// Copies of images that cannot be used as they are. Each is made by the first frame that needs it.
#[derive(Debug, Default)]
pub(crate) struct Copies {
    depth: Vec<[f32; 1]>,
    normal: Vec<[f32; 3]>,
    second: Vec<[f32; 1]>,
}

/// Checks everything but the pixels of a frame.
///
/// # Errors
/// When a field is out of its range.
///
/// # Safety
/// Images have the pixels that sizes and strides promise, and matrices have 16 numbers. The input images do not change
/// during `'a`.
pub(crate) unsafe fn read<'a>(frame: &Frame, window: Window) -> Result<(Inputs<'a>, Output)> {
    // SAFETY: the caller's promise.
    let (projection, view) = unsafe {
        let projection = matrix("clip_from_view", frame.clip_from_view)?;
        (projection, matrix("view_from_world", frame.view_from_world)?)
    };
    let camera = camera((frame.fov_y, projection), view, window)?;
    let params = AoParams::new(frame.radius)?;
    let size = window.buffer_size();
    let view_from_world = view.map(|_| camera.view_from_world().matrix3);
    // SAFETY: the caller's promise.
    unsafe {
        let depth = Input::new("depth", &frame.depth, size)?;
        let normal = Input::new("normal", &frame.normal, size)?;
        let has_second = !frame.second_depth.data.is_null();
        let second = has_second.then(|| Input::new("second_depth", &frame.second_depth, size)).transpose()?;
        let output = Output::new("visibility", &frame.visibility, window.size())?;
        Ok((Inputs { window, camera, depth, normal, second, view_from_world, params }, output))
    }
}

impl Inputs<'_> {
    /// The frame, in the program's memory where that is possible, else in `copies`.
    ///
    /// # Errors
    /// When a pixel is out of its range, or there is not enough memory for copies.
    pub(crate) fn gbuffer<'b>(&'b self, copies: &'b mut Copies) -> Result<GBuffer<'b>> {
        let depth = self.depth.borrow_or_copy("copy of depth", &mut copies.depth)?.as_flattened();
        let is_view = self.view_from_world.is_none();
        let normal = match self.normal.as_slice().filter(|normal| is_view && is_tidy(depth, normal)) {
            Some(normal) => normal,
            None => {
                self.normal.copy_to("copy of normals", &mut copies.normal)?;
                if let Some(rotation) = self.view_from_world {
                    copies.normal.iter_mut().for_each(|n| *n = (rotation * Vec3A::from(*n)).to_array());
                }
                tidy(depth, &mut copies.normal);
                &copies.normal
            }
        };
        let gbuffer = GBuffer::new(self.camera, depth, normal)?.with_margin(self.window.margin())?;
        let Some(second) = &self.second else {
            return Ok(gbuffer);
        };
        let depth = second.borrow_or_copy("copy of second_depth", &mut copies.second)?.as_flattened();
        Ok(gbuffer.with_second(SecondLayer { depth: depth.into(), normal: None })?)
    }
}

/// The camera of picture and guard band.
fn camera(
    of_picture: (f32, Option<[[f32; 4]; 4]>),
    view_from_world: Option<[[f32; 4]; 4]>,
    window: Window,
) -> Result<Camera> {
    let size = window.size();
    let either = |found| Err(Failure::argument("camera", "one of fov_y and clip_from_view", found));
    let camera = match of_picture {
        (0.0, None) => return either("none"),
        (0.0, Some(m)) => Camera::from_clip_from_view(with_plain_depth(m), ClipDepth::ZeroToOne, size)?,
        (fov_y, None) => Camera::perspective(fov_y, size)?,
        (_, Some(_)) => return either("both"),
    };
    let camera = camera.with_margin(window.margin())?;
    Ok(match view_from_world {
        Some(view) => camera.with_view_from_world(view)?,
        None => camera,
    })
}

/// The same matrix with a third row that has a near plane: which range of depths a program uses does not matter here.
fn with_plain_depth([mut x, mut y, mut z, mut w]: [[f32; 4]; 4]) -> [[f32; 4]; 4] {
    let is_perspective = w[3] == 0.0;
    (x[2], y[2]) = (0.0, 0.0);
    (z[2], w[2]) = if is_perspective { (0.0, 1.0) } else { (-1.0, 0.0) };
    [x, y, z, w]
}

/// Whether normals are 0 on the background and else of unit length but for rounding.
fn is_tidy(depth: &[f32], normal: &[[f32; 3]]) -> bool {
    let is_uneven = |(d, [x, y, z]): (&f32, &[f32; 3])| {
        let squared = x * x + y * y + z * z;
        match *d < f32::INFINITY {
            true => (squared - 1.0).abs() > TIDY_TOLERANCE,
            false => squared != 0.0,
        }
    };
    !depth.iter().zip(normal).map(is_uneven).fold(false, |any, one| any | one)
}

/// Makes normals 0 on the background and else of unit length, if they are not. Leaves those that cannot be normals.
fn tidy(depth: &[f32], normal: &mut [[f32; 3]]) {
    if is_tidy(depth, normal) {
        return;
    }
    for (d, n) in depth.iter().zip(normal) {
        let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
        if *d == f32::INFINITY {
            *n = [0.0; 3];
        } else if (length - 1.0).abs() <= UNIT_TOLERANCE {
            *n = n.map(|c| c / length);
        }
    }
}
