//! The numbers of a frame as shaders read them.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::frame::window::Margin;
use crate::gpu::options::{DepthEncoding, Frame, NormalSpace, TextureEncoding};
use glam::Mat3A;

/// Bytes of the struct `Frame` of `surface.wgsl`.
pub(crate) const FRAME_BYTES: usize = 112;

/// That struct for frames of a size (width, height) (px) with a guard band of `margin` inside.
///
/// # Errors
/// When the camera is of another size or out of range, or the planes are.
pub(crate) fn frame_bytes(
    textures: TextureEncoding,
    (width, height): (usize, usize),
    margin: Margin,
    frame: &Frame,
) -> Result<[u8; FRAME_BYTES]> {
    let (camera, radius) = (frame.camera, frame.params.radius());
    Size::new(width, height)?.expect("camera of a frame", camera.size())?;
    let view_from_normals = match textures.normal_space {
        NormalSpace::View => Mat3A::IDENTITY,
        NormalSpace::World => camera.view_from_world().matrix3,
    };
    let [focal_x, focal_y] = camera.focal_px();
    let pixel_size = if camera.is_perspective() { [1.0 / focal_y, 0.0] } else { [0.0, 1.0 / focal_y] };
    let mut words = [0u32; FRAME_BYTES / 4];
    let mut put = |at: usize, values: &[f32]| {
        words[at..at + values.len()].iter_mut().zip(values).for_each(|(word, v)| *word = v.to_bits());
    };
    for (i, column) in view_from_normals.to_cols_array_2d().iter().enumerate() {
        put(4 * i, column);
    }
    put(14, &depth_line(textures.depth, frame)?);
    put(16, &pixel_size);
    put(18, &[radius, camera.projected_px(radius, 1.0).log2()]);
    put(20, &camera.centre_px());
    put(22, &[focal_y / focal_x]);
    (words[12], words[13]) = (width as u32, height as u32);
    (words[24], words[25]) = (margin.x as u32, margin.y as u32);
    let mut bytes = [0; FRAME_BYTES];
    bytes.chunks_exact_mut(4).zip(words).for_each(|(bytes, word)| bytes.copy_from_slice(&word.to_le_bytes()));
    Ok(bytes)
}

/// Slope and offset that make a distance, or with perspective its inverse, of a stored depth.
fn depth_line(encoding: DepthEncoding, frame: &Frame) -> Result<[f32; 2]> {
    let perspective = frame.camera.is_perspective();
    let (near, far) = (f64::from(frame.camera.near()), f64::from(frame.far));
    let at = |v: f64| if perspective { 1.0 / v } else { v };
    let (at_0, at_1) = match encoding {
        DepthEncoding::Linear => return Ok([1.0, 0.0]),
        DepthEncoding::Reversed => (at(far), at(near)),
        DepthEncoding::Standard => (at(near), at(far)),
    };
    if !(far > near) || !at_0.is_finite() || !at_1.is_finite() {
        let expected = match perspective {
            true => "0 < near < far",
            false => "0 <= near < far, both finite",
        };
        return Err(Error::value("planes of a frame", expected, format!("near {near}, far {far}")));
    }
    Ok([(at_1 - at_0) as f32, at_0 as f32])
}
