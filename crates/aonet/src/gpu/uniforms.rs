//! The numbers of a frame as shaders read them.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::frame::window::Margin;
use crate::gpu::options::{DepthEncoding, FrameNumbers, NormalSpace, TextureEncoding};
use glam::Mat3A;

/// A number or a vector among the numbers of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameField {
    /// Its name in the struct `Frame` of the shaders, which also says what it means.
    pub name: &'static str,
    /// Its type in WGSL.
    pub ty: &'static str,
    /// Where it begins, in bytes.
    pub offset: usize,
}

/// Bytes of the numbers of a frame.
pub const FRAME_BYTES: usize = 112;

/// The numbers of a frame: the struct `Frame` of `surface.wgsl`. Columns of the matrix are 16 bytes apart.
pub const FRAME_FIELDS: [FrameField; 9] = [
    field("view_from_normals", "mat3x3<f32>", 0),
    field("size", "vec2<u32>", 48),
    field("depth_line", "vec2<f32>", 56),
    field("pixel_size", "vec2<f32>", 64),
    field("centre", "vec2<f32>", 72),
    field("aspect", "f32", 80),
    field("radius", "f32", 84),
    field("log2_radius_px", "f32", 88),
    field("margin", "vec2<u32>", 96),
];

const fn field(name: &'static str, ty: &'static str, offset: usize) -> FrameField {
    FrameField { name, ty, offset }
}

/// Those numbers as bytes.
struct Bytes([u8; FRAME_BYTES]);

impl Bytes {
    /// Writes a field, or its part `words` words of 32 bits behind its beginning.
    fn put(&mut self, name: &str, words: usize, values: &[u32]) {
        let found = FRAME_FIELDS.iter().find(|field| field.name == name);
        let at = found.expect("a field of the frame").offset + 4 * words;
        let places = self.0[at..].chunks_exact_mut(4);
        places.zip(values).for_each(|(place, value)| place.copy_from_slice(&value.to_le_bytes()));
    }

    fn put_floats(&mut self, name: &str, values: &[f32]) {
        values.iter().enumerate().for_each(|(i, value)| self.put(name, i, &[value.to_bits()]));
    }
}

/// That struct for frames of `size`, of which `margin` is the guard band.
///
/// # Errors
/// When the camera is of another size or out of range, or the planes are.
pub(crate) fn frame_bytes(
    textures: TextureEncoding,
    size: Size,
    margin: Margin,
    frame: &FrameNumbers,
) -> Result<[u8; FRAME_BYTES]> {
    let (camera, radius) = (frame.camera, frame.params.radius());
    size.expect("camera of a frame", camera.size())?;
    let view_from_normals = match textures.normal_space {
        NormalSpace::View => Mat3A::IDENTITY,
        NormalSpace::World => camera.view_from_world().matrix3,
    };
    let mut bytes = Bytes([0; FRAME_BYTES]);
    for (i, column) in view_from_normals.to_cols_array_2d().iter().enumerate() {
        bytes.put("view_from_normals", 4 * i, &column.map(f32::to_bits));
    }
    // The fields of the lens follow each other.
    bytes.put("size", 0, &Lens::new(textures.depth, frame)?.words());
    bytes.put_floats("radius", &[radius]);
    bytes.put_floats("log2_radius_px", &[camera.projected_px(radius, 1.0).log2()]);
    bytes.put("margin", 0, &[margin.x as u32, margin.y as u32]);
    Ok(bytes.0)
}

/// How the camera of a frame projects, as shaders read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Width and height (px).
    pub size: [u32; 2],
    /// Slope and offset that make a distance, or with perspective its inverse, of a stored depth.
    pub depth_line: [f32; 2],
    /// Height of a pixel (world units): the first times the depth plus the second. One of them is 0.
    pub pixel_size: [f32; 2],
    /// The place that the camera's axis meets (px from the upper left corner).
    pub centre: [f32; 2],
    /// Width of a pixel over its height.
    pub aspect: f32,
}

/// Words of a [`Lens`].
pub const LENS_WORDS: usize = 9;

impl Lens {
    /// The numbers of a frame whose depth texture has an encoding.
    ///
    /// # Errors
    /// When the planes are out of range.
    pub fn new(depth: DepthEncoding, frame: &FrameNumbers) -> Result<Self> {
        let camera = &frame.camera;
        let [focal_x, focal_y] = camera.focal_px();
        Ok(Self {
            size: [camera.width() as u32, camera.height() as u32],
            depth_line: depth_line(depth, frame)?,
            pixel_size: if camera.is_perspective() { [1.0 / focal_y, 0.0] } else { [0.0, 1.0 / focal_y] },
            centre: camera.centre_px(),
            aspect: focal_y / focal_x,
        })
    }

    /// Its fields one after the other: where a shader's struct has them.
    pub fn words(&self) -> [u32; LENS_WORDS] {
        let ([a, b], [c, d], [e, f]) = (self.depth_line, self.pixel_size, self.centre);
        let [x, y] = self.size;
        let [a, b, c, d, e, f, g] = [a, b, c, d, e, f, self.aspect].map(f32::to_bits);
        [x, y, a, b, c, d, e, f, g]
    }
}

/// Slope and offset that make a distance, or with perspective its inverse, of a stored depth.
fn depth_line(encoding: DepthEncoding, frame: &FrameNumbers) -> Result<[f32; 2]> {
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

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::options::Precision;
    use crate::gpu::surface::Surface;
    use wgpu::naga;

    #[test]
    fn shaders_see_the_fields_where_they_are_written() {
        let surface = Surface { precision: Precision::F32, textures: TextureEncoding::default() };
        let module = naga::front::wgsl::parse_str(surface.shader().source()).unwrap();
        let of_frame = |ty: &naga::Type| ty.name.as_deref() == Some("Frame");
        let (_, ty) = module.types.iter().find(|(_, ty)| of_frame(ty)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("a struct") };
        let found: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        let expected: Vec<_> = FRAME_FIELDS.iter().map(|field| (field.name, field.offset)).collect();
        assert_eq!((found, *span as usize), (expected, FRAME_BYTES));
        for field in FRAME_FIELDS {
            let declared = format!("    {}: {},", field.name, field.ty);
            assert!(include_str!("surface.wgsl").lines().any(|line| line == declared), "{declared}");
        }
    }
}
