//! The picture of a frame and the guard band around it.

use crate::error::{Error, Result};
use crate::frame::size::Size;
use std::fmt;

/// Pixels of guard band on each side of a picture: methods read them, results do not contain them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Margin {
    /// Columns on the left and as many on the right (px).
    pub x: usize,
    /// Rows above and as many below (px).
    pub y: usize,
}

impl Margin {
    /// No guard band.
    pub const NONE: Self = Self { x: 0, y: 0 };

    /// A guard band of a `share` of the picture's width and height on each side, rounded to whole pixels.
    pub fn share(size: Size, share: f32) -> Self {
        let part = |side: usize| (side as f32 * share.max(0.0)).round() as usize;
        Self { x: part(size.width()), y: part(size.height()) }
    }
}

/// A picture and its guard band. Depth and normals cover both: they are a buffer of [`Window::buffer_size`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Window {
    size: Size,
    margin: Margin,
    buffer: Size,
}

impl Window {
    /// A picture of `size` with `margin` around it.
    ///
    /// # Errors
    /// When the buffer would be larger than [`MAX_SIDE`](crate::frame::size::MAX_SIDE).
    pub fn new(size: Size, margin: Margin) -> Result<Self> {
        let sum = |side: usize, margin: usize| side.saturating_add(margin.saturating_mul(2));
        let buffer = Size::new(sum(size.width(), margin.x), sum(size.height(), margin.y))?;
        Ok(Self { size, margin, buffer })
    }

    /// The picture in a buffer of size `buffer` whose outer pixels are `margin`.
    ///
    /// # Errors
    /// When the margin leaves no picture.
    pub fn inside(buffer: Size, margin: Margin) -> Result<Self> {
        let rest = |side: usize, margin: usize| side.saturating_sub(margin.saturating_mul(2));
        let [width, height] = [rest(buffer.width(), margin.x), rest(buffer.height(), margin.y)];
        if width == 0 || height == 0 {
            let expected = format!("less than half of the buffer's {buffer} pixels on each side");
            return Err(Error::value(
                "margin",
                expected,
                format!("{} columns and {} rows", margin.x, margin.y),
            ));
        }
        let size = Size::new(width, height)?;
        Ok(Self { size, margin, buffer })
    }

    /// A picture without a guard band.
    pub const fn without_margin(size: Size) -> Self {
        Self { size, margin: Margin::NONE, buffer: size }
    }

    /// Size of the picture (px).
    pub const fn size(self) -> Size {
        self.size
    }

    /// The guard band (px).
    pub const fn margin(self) -> Margin {
        self.margin
    }

    /// Size of the picture with its guard band (px).
    pub const fn buffer_size(self) -> Size {
        self.buffer
    }

    /// Whether there is a guard band.
    pub fn has_margin(self) -> bool {
        self.margin != Margin::NONE
    }

    /// The part of a row-major image of the buffer that belongs to row `y` of the picture.
    ///
    /// # Panics
    /// When the image is smaller than the buffer or the picture has no such row.
    pub fn row<T>(self, buffer: &[T], y: usize) -> &[T] {
        let first = (self.margin.y + y) * self.buffer.width() + self.margin.x;
        &buffer[first..first + self.size.width()]
    }

    /// Copies the picture out of a row-major image of the buffer.
    ///
    /// # Panics
    /// When `buffer` or `picture` is of another size.
    pub fn crop<T: Copy>(self, buffer: &[T], picture: &mut [T]) {
        assert_eq!((buffer.len(), picture.len()), (self.buffer.pixels(), self.size.pixels()));
        for (y, row) in picture.chunks_exact_mut(self.size.width()).enumerate() {
            row.copy_from_slice(self.row(buffer, y));
        }
    }

    /// The picture of a row-major image of the buffer; without a margin, the image itself.
    ///
    /// # Panics
    /// When `buffer` is of another size.
    pub fn cropped<T: Copy>(self, buffer: Vec<T>) -> Vec<T> {
        if !self.has_margin() {
            return buffer;
        }
        (0..self.size.height()).flat_map(|y| self.row(&buffer, y)).copied().collect()
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.size)?;
        match self.has_margin() {
            true => write!(f, " with a margin of {} columns and {} rows", self.margin.x, self.margin.y),
            false => Ok(()),
        }
    }
}

impl From<Size> for Window {
    fn from(size: Size) -> Self {
        Self::without_margin(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::size::MAX_SIDE;

    #[test]
    fn a_crop_is_the_middle() {
        let window = Window::new(Size::px(2, 1), Margin { x: 1, y: 2 }).unwrap();
        assert_eq!(window.buffer_size(), Size::px(4, 5));
        let buffer: Vec<usize> = (0..20).collect();
        let mut picture = [0; 2];
        window.crop(&buffer, &mut picture);
        assert_eq!(picture, [9, 10]);
        assert_eq!(window.cropped(buffer), [9, 10]);
    }

    #[test]
    fn sums_do_not_overflow() {
        for margin in [Margin { x: usize::MAX, y: 0 }, Margin { x: 0, y: MAX_SIDE / 2 + 1 }] {
            assert!(Window::new(Size::px(1, 1), margin).is_err());
        }
    }

    #[test]
    fn shares_are_of_each_side() {
        assert_eq!(Margin::share(Size::px(1280, 720), 0.1), Margin { x: 128, y: 72 });
        assert_eq!(Margin::share(Size::px(8, 8), f32::NAN), Margin::NONE);
    }
}
