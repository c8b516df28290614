//! Images of a C program: pixels that may lie apart, and rows that may lie from the bottom up.
#![allow(unsafe_code, reason = "reads and writes memory of a C program")]

use crate::abi::{InputImage, OutputImage};
use crate::arguments::filled;
use crate::failure::{Failure, Result};
use aonet::{AoImage, Size};
use std::marker::PhantomData;

/// Where the pixels of an image lie: strides in bytes, checked.
#[derive(Debug, Clone, Copy)]
struct Layout {
    size: Size,
    pixel_stride: isize,
    row_stride: isize,
    is_tight: bool,
}

impl Layout {
    /// # Errors
    /// When a stride is too small, not a multiple of 4 or too large, or the pointer is null or not aligned to 4 bytes.
    fn new(
        name: &str,
        (data, channels): (*const f32, usize),
        [pixel_stride, row_stride]: [isize; 2],
        size: Size,
    ) -> Result<Self> {
        let wrong = |what: &str, expected: String, found: isize| {
            Err(Failure::argument(&format!("{what} of {name}"), expected, found))
        };
        if data.is_null() || !data.is_aligned() {
            let found = if data.is_null() { "NULL" } else { "a pointer that is not aligned" };
            let expected = "a pointer to floats, aligned to 4 bytes";
            return Err(Failure::argument(&format!("data of {name}"), expected, found));
        }
        // At most 12 * 32768: these do not overflow.
        let pixel = (channels * size_of::<f32>()) as isize;
        let tight_row = pixel * size.width() as isize;
        let pixel_step = if pixel_stride == 0 { pixel } else { pixel_stride };
        if pixel_step < pixel || pixel_step % 4 != 0 {
            return wrong(
                "pixel_stride",
                format!("0 or a multiple of 4 from {pixel} bytes on"),
                pixel_stride,
            );
        }
        let row = pixel_step.checked_mul(size.width() as isize - 1).and_then(|row| row.checked_add(pixel));
        let Some(row) = row else {
            return wrong("pixel_stride", "an image that fits in memory".into(), pixel_stride);
        };
        let row_step = match row_stride {
            0 => pixel_step.checked_mul(size.width() as isize).unwrap_or(row),
            row_stride => row_stride,
        };
        if row_step.unsigned_abs() < row.unsigned_abs() || row_step % 4 != 0 {
            let expected = format!("0 or a multiple of 4, from {row} bytes on or below -{row}");
            return wrong("row_stride", expected, row_stride);
        }
        let rows = row_step.checked_mul(size.height() as isize - 1);
        if rows.and_then(|rows| rows.checked_abs()?.checked_add(row)).is_none() {
            return wrong("row_stride", "an image that fits in memory".into(), row_stride);
        }
        let is_tight = pixel_step == pixel && (row_step == tight_row || size.height() == 1);
        Ok(Self { size, pixel_stride: pixel_step, row_stride: row_step, is_tight })
    }

    /// Bytes from the first pixel of the image to the first one of row `y`; it fits, as [`Layout::new`] has checked.
    fn row(&self, y: usize) -> isize {
        self.row_stride * y as isize
    }

    /// Bytes from the first pixel of a row to pixel `x`.
    fn column(&self, x: usize) -> isize {
        self.pixel_stride * x as isize
    }
}

/// An image of `CHANNELS` numbers a pixel that is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Input<'a, const CHANNELS: usize> {
    data: *const [f32; CHANNELS],
    layout: Layout,
    pixels: PhantomData<&'a [f32]>,
}

impl<'a, const CHANNELS: usize> Input<'a, CHANNELS> {
    /// # Errors
    /// When the pointer is null or not aligned, or a stride cannot be.
    ///
    /// # Safety
    /// The image has the pixels that size and strides promise, and nothing writes them during `'a`.
    pub(crate) unsafe fn new(name: &str, image: &InputImage, size: Size) -> Result<Self> {
        let strides = [image.pixel_stride, image.row_stride];
        let layout = Layout::new(name, (image.data, CHANNELS), strides, size)?;
        Ok(Self { data: image.data.cast(), layout, pixels: PhantomData })
    }

    /// The pixels, where there are no gaps between them.
    pub(crate) fn as_slice(&self) -> Option<&'a [[f32; CHANNELS]]> {
        // SAFETY: without gaps, `Input::new` was promised as many pixels as the size has; the pointer is aligned.
        self.layout
            .is_tight
            .then(|| unsafe { std::slice::from_raw_parts(self.data, self.layout.size.pixels()) })
    }

    /// Copies the pixels; `to` grows once, to their number.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn copy_to(&self, name: &str, to: &mut Vec<[f32; CHANNELS]>) -> Result<()> {
        let size = self.layout.size;
        if to.len() != size.pixels() {
            *to = filled(name, size.pixels(), [0.0; CHANNELS])?;
        }
        for (y, row) in to.chunks_exact_mut(size.width()).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                // SAFETY: the pixel is in the image that `Input::new` was promised; strides keep the alignment.
                *pixel = unsafe {
                    self.data.byte_offset(self.layout.row(y)).byte_offset(self.layout.column(x)).read()
                };
            }
        }
        Ok(())
    }

    /// The pixels: borrowed where there are no gaps between them, else copied as by [`Input::copy_to`].
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn borrow_or_copy<'b>(
        &self,
        name: &str,
        to: &'b mut Vec<[f32; CHANNELS]>,
    ) -> Result<&'b [[f32; CHANNELS]]>
    where
        'a: 'b,
    {
        if let Some(pixels) = self.as_slice() {
            return Ok(pixels);
        }
        self.copy_to(name, to)?;
        Ok(to)
    }
}

/// An image of one number a pixel that is written.
#[derive(Debug)]
pub(crate) struct Output {
    data: *mut f32,
    layout: Layout,
}

impl Output {
    /// # Errors
    /// When the pointer is null or not aligned, or a stride cannot be.
    ///
    /// # Safety
    /// The image has the pixels that size and strides promise, until [`Output::write`] returns.
    pub(crate) unsafe fn new(name: &str, image: &OutputImage, size: Size) -> Result<Self> {
        let strides = [image.pixel_stride, image.row_stride];
        let layout = Layout::new(name, (image.data.cast_const(), 1), strides, size)?;
        Ok(Self { data: image.data, layout })
    }

    /// Writes all pixels, and nothing between them.
    ///
    /// # Panics
    /// When `image` is of another size.
    pub(crate) fn write(self, image: &AoImage) {
        assert_eq!(image.size(), self.layout.size, "an image of another size");
        for (y, row) in image.visibility().chunks_exact(image.width()).enumerate() {
            for (x, visibility) in row.iter().enumerate() {
                // SAFETY: the pixel is in the image that `Output::new` was promised; strides keep the alignment.
                unsafe {
                    let pixel = self.data.byte_offset(self.layout.row(y)).byte_offset(self.layout.column(x));
                    pixel.write(*visibility);
                }
            }
        }
    }
}
