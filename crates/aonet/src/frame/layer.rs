//! Images of a renderer as they lie in memory, and the memory that they are read into.

use crate::error::{Error, Result};
use crate::frame::camera::Camera;
use crate::frame::check::{self, Facing};
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use half::f16;
use std::borrow::Cow;

/// Numbers in memory.
#[derive(Debug, Clone, Copy)]
pub enum Numbers<'a> {
    /// 32-bit floats.
    F32(&'a [f32]),
    /// 16-bit floats, as their bits.
    F16(&'a [u16]),
}

impl Numbers<'_> {
    fn len(&self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F16(bits) => bits.len(),
        }
    }

    fn at(&self, i: usize) -> f32 {
        match self {
            Self::F32(numbers) => numbers[i],
            Self::F16(bits) => f16::from_bits(bits[i]).to_f32(),
        }
    }
}

/// An image whose pixels may lie apart: rows from the top, the channels of a pixel side by side.
#[derive(Debug, Clone, Copy)]
pub struct Pixels<'a> {
    /// The numbers of all pixels.
    pub numbers: Numbers<'a>,
    /// Index of the first number of the upper left pixel.
    pub first: usize,
    /// Numbers from a pixel to the next one of its row.
    pub pixel_stride: usize,
    /// Numbers from a row to the next one.
    pub row_stride: usize,
}

impl<'a> Pixels<'a> {
    /// An image without gaps: `channels` numbers for each pixel.
    pub fn tight(numbers: Numbers<'a>, channels: usize, width: usize) -> Self {
        Self { numbers, first: 0, pixel_stride: channels, row_stride: channels * width }
    }

    /// # Errors
    /// When the last of `channels` numbers of the last pixel lies beyond the end.
    fn check(&self, what: &str, size: Size, channels: usize) -> Result<()> {
        let row = (size.width() - 1).checked_mul(self.pixel_stride);
        let rows = (size.height() - 1).checked_mul(self.row_stride);
        let last =
            row.zip(rows).and_then(|(x, y)| self.first.checked_add(x)?.checked_add(y)?.checked_add(channels));
        if last.is_some_and(|last| last <= self.numbers.len()) {
            return Ok(());
        }
        let expected = last.map_or("strides that fit in memory".into(), |last| format!("{last} numbers"));
        Err(Error::size(what, expected, self.numbers.len()))
    }

    fn read<const CHANNELS: usize>(&self, x: usize, y: usize) -> [f32; CHANNELS] {
        let i = self.first + x * self.pixel_stride + y * self.row_stride;
        std::array::from_fn(|c| self.numbers.at(i + c))
    }
}

/// Memory for the depth and the normals of frames of one size that are not stored as [`GBuffer`] has them: with gaps,
/// or in half floats. It is kept from frame to frame, so that reading a frame allocates nothing.
#[derive(Debug)]
pub struct FrameMemory {
    size: Size,
    depth: Vec<f32>,
    normal: Vec<[f32; 3]>,
}

impl FrameMemory {
    /// Memory for frames of a size.
    pub fn new(size: Size) -> Self {
        Self { size, depth: vec![1.0; size.pixels()], normal: vec![[0.0; 3]; size.pixels()] }
    }

    /// Reads a frame: one number of depth and three of normal for each pixel, with the meaning that they have in
    /// [`GBuffer::new`].
    ///
    /// # Errors
    /// When the camera is of another size, an image is too short, or as [`GBuffer::new`].
    pub fn read(&mut self, camera: Camera, depth: Pixels<'_>, normal: Pixels<'_>) -> Result<GBuffer<'_>> {
        self.size.expect("camera of a frame", camera.size())?;
        depth.check("depth", self.size, 1)?;
        normal.check("normals", self.size, 3)?;
        let width = self.size.width();
        let lines = self.depth.chunks_exact_mut(width).zip(self.normal.chunks_exact_mut(width));
        for (y, (depths, normals)) in lines.enumerate() {
            for (x, (d, n)) in depths.iter_mut().zip(normals).enumerate() {
                ([*d], *n) = (depth.read(x, y), normal.read(x, y));
            }
        }
        if !check::layer("", &camera, (&self.depth, &self.normal), Facing::Viewer)? {
            check::tidy(&self.depth, &mut self.normal);
        }
        let (depth, normal) = (Cow::Borrowed(&self.depth[..]), Cow::Borrowed(&self.normal[..]));
        Ok(GBuffer::of_checked(camera, depth, normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same frame from tight floats, and from half floats with gaps.
    #[test]
    fn gaps_and_half_floats_are_read() {
        let size = Size::px(3, 2);
        let camera = Camera::perspective(1.0, size).unwrap();
        let depth = vec![1.0, 2.0, 3.0, f32::INFINITY, 5.0, 6.0];
        let normal = vec![[0.0, 0.0, 1.0]; 6];
        let expected = GBuffer::new(camera, depth.clone(), normal.clone()).unwrap();
        // Normal and depth side by side, four numbers each, and two more at the end of every row.
        let mut bits = vec![f16::NAN.to_bits(); 2 * 14];
        for i in 0..6 {
            let at = i / 3 * 14 + i % 3 * 4;
            let four = [normal[i][0], normal[i][1], normal[i][2], depth[i]];
            bits[at..at + 4].copy_from_slice(&four.map(|v| f16::from_f32(v).to_bits()));
        }
        let numbers = Numbers::F16(&bits);
        let normals = Pixels { numbers, first: 0, pixel_stride: 4, row_stride: 14 };
        let mut memory = FrameMemory::new(size);
        assert_eq!(memory.read(camera, Pixels { first: 3, ..normals }, normals).unwrap(), expected);
        let (depths, flat) = (Numbers::F32(&depth), Numbers::F32(normal.as_flattened()));
        let found = memory.read(camera, Pixels::tight(depths, 1, 3), Pixels::tight(flat, 3, 3)).unwrap();
        assert_eq!(found, expected);
    }

    #[test]
    fn images_that_are_too_short_are_refused() {
        let camera = Camera::perspective(1.0, Size::px(3, 2)).unwrap();
        let mut memory = FrameMemory::new(Size::px(3, 2));
        let (depth, normal) = (vec![1.0; 6], vec![0.0; 17]);
        let good = Pixels::tight(Numbers::F32(&depth), 1, 3);
        let short = Pixels::tight(Numbers::F32(&normal), 3, 3);
        assert!(memory.read(camera, good, short).unwrap_err().to_string().contains("normals"));
        let endless = Pixels { row_stride: usize::MAX, ..good };
        assert!(memory.read(camera, endless, good).unwrap_err().to_string().contains("depth"));
    }
}
