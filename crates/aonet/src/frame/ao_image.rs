//! Ambient occlusion as an image, and its one parameter.

use crate::error::{Error, Result};
use crate::frame::size::Size;

/// What ambient occlusion means in a frame. Checked when it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AoParams {
    radius: f32,
}

impl AoParams {
    /// Parameters with the given radius (world units).
    ///
    /// # Errors
    /// When the radius is not finite or not above zero.
    pub fn new(radius: f32) -> Result<Self> {
        if radius.is_finite() && radius > 0.0 {
            return Ok(Self { radius });
        }
        Err(Error::value("radius", "a finite length > 0 (world units)", radius))
    }

    /// Length of the occlusion rays (world units), finite and > 0.
    pub fn radius(self) -> f32 {
        self.radius
    }
}

/// HxW visibility in [0, 1], row 0 at the top: 1 open, 0 closed; background 1.
#[derive(Debug, Clone, PartialEq)]
pub struct AoImage {
    size: Size,
    visibility: Vec<f32>,
}

impl AoImage {
    /// An image of fully open pixels.
    pub fn open(size: Size) -> Self {
        Self { size, visibility: vec![1.0; size.pixels()] }
    }

    /// An image from one value for each pixel, row by row. Values are clamped to [0, 1].
    ///
    /// # Errors
    /// When the number of values is wrong or a value is NaN.
    pub fn new(size: Size, mut visibility: Vec<f32>) -> Result<Self> {
        if visibility.len() != size.pixels() {
            return Err(Error::size("AO image", size.pixels(), visibility.len()));
        }
        for (i, v) in visibility.iter_mut().enumerate() {
            if v.is_nan() {
                let at = format!("visibility at ({}, {})", i % size.width(), i / size.width());
                return Err(Error::value(at, "a number in [0, 1]", "NaN"));
            }
            *v = v.clamp(0.0, 1.0);
        }
        Ok(Self { size, visibility })
    }

    /// Size (px).
    pub fn size(&self) -> Size {
        self.size
    }

    /// Width (px).
    pub fn width(&self) -> usize {
        self.size.width()
    }

    /// Height (px).
    pub fn height(&self) -> usize {
        self.size.height()
    }

    /// HxW values in [0, 1], row by row from the top.
    pub fn visibility(&self) -> &[f32] {
        &self.visibility
    }

    /// The values, for methods that write them. Writers keep them in [0, 1].
    pub fn visibility_mut(&mut self) -> &mut [f32] {
        &mut self.visibility
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_must_be_positive_and_finite() {
        assert!(AoParams::new(0.5).is_ok());
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(AoParams::new(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn nan_and_wrong_sizes_are_refused() {
        assert!(
            AoImage::new(Size::px(2, 1), vec![0.5, f32::NAN]).unwrap_err().to_string().contains("(1, 0)")
        );
        assert!(AoImage::new(Size::px(2, 2), vec![0.5; 3]).is_err());
        assert_eq!(AoImage::new(Size::px(1, 2), vec![-1.0, 2.0]).unwrap().visibility(), [0.0, 1.0]);
    }
}
