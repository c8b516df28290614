//! The size of an image.

use crate::error::{Error, Result};
use std::fmt;

/// The largest width or height of an image (px): every pixel count then fits into `u32`.
pub const MAX_SIDE: usize = 32_768;

/// Width and height of an image (px), each in `1..=`[`MAX_SIDE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Size {
    width: usize,
    height: usize,
}

impl Size {
    /// A size of `width` x `height` (px).
    ///
    /// # Errors
    /// When a side is 0 or larger than [`MAX_SIDE`].
    pub fn new(width: usize, height: usize) -> Result<Self> {
        Self::named("image", width, height)
    }

    /// [`Size::new`] of a thing that errors call `what`.
    ///
    /// # Errors
    /// When a side is 0 or larger than [`MAX_SIDE`].
    pub fn named(what: &str, width: usize, height: usize) -> Result<Self> {
        if in_range(width) && in_range(height) {
            return Ok(Self { width, height });
        }
        let expected = format!("width and height in 1..={MAX_SIDE}");
        Err(Error::size(what, expected, format!("{width}x{height}")))
    }

    /// A size that is a constant of the program (px).
    ///
    /// # Panics
    /// When a side is 0 or larger than [`MAX_SIDE`]. Use [`Size::new`] for sizes from outside.
    pub const fn px(width: usize, height: usize) -> Self {
        assert!(in_range(width) && in_range(height), "width and height must be in 1..=MAX_SIDE");
        Self { width, height }
    }

    /// Width (px).
    pub const fn width(self) -> usize {
        self.width
    }

    /// Height (px).
    pub const fn height(self) -> usize {
        self.height
    }

    /// The number of pixels.
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }

    /// Accepts an image that has this size.
    ///
    /// # Errors
    /// When `found` is another size; the message names the image `what`.
    pub fn expect(self, what: &str, found: Self) -> Result<()> {
        if self == found {
            return Ok(());
        }
        Err(Error::size(what, self, found))
    }
}

const fn in_range(side: usize) -> bool {
    side >= 1 && side <= MAX_SIDE
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_checked() {
        let size = Size::new(640, 360).unwrap();
        assert_eq!((size.to_string().as_str(), size.pixels()), ("640x360", 230_400));
        for (width, height) in [(0, 4), (4, 0), (MAX_SIDE + 1, 4), (4, usize::MAX)] {
            let error = Size::new(width, height).unwrap_err().to_string();
            assert!(error.contains(&format!("{width}x{height}")), "{error}");
        }
        assert!(Size::new(MAX_SIDE, MAX_SIDE).is_ok());
    }

    #[test]
    fn another_size_is_named() {
        let error = Size::px(4, 3).expect("AO image", Size::px(3, 4)).unwrap_err().to_string();
        assert!(error.contains("AO image") && error.contains("4x3") && error.contains("3x4"), "{error}");
    }
}
