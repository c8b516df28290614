//! Bent normals as an image.

use crate::error::{Error, Result};
use crate::frame::size::Size;

/// HxW mean directions of the light that is not blocked within the AO radius, row 0 at the top: unit vectors in view space, as a
/// G-buffer's normals; the surface's normal where everything is blocked; zero on the background.
#[derive(Debug, Clone, PartialEq)]
pub struct BentNormals {
    size: Size,
    direction: Vec<[f32; 3]>,
}

impl BentNormals {
    /// An image of zeros, for methods that write it.
    pub fn zeros(size: Size) -> Self {
        Self { size, direction: vec![[0.0; 3]; size.pixels()] }
    }

    /// An image from one direction for each pixel, row by row.
    ///
    /// # Errors
    /// When the number of directions is wrong, or one has a component that is not finite.
    pub fn new(size: Size, direction: Vec<[f32; 3]>) -> Result<Self> {
        if direction.len() != size.pixels() {
            return Err(Error::size("bent normals", size.pixels(), direction.len()));
        }
        if let Some(i) = direction.iter().position(|d| !d.iter().all(|c| c.is_finite())) {
            let at = format!("bent normal at ({}, {})", i % size.width(), i / size.width());
            return Err(Error::value(at, "finite components", format!("{:?}", direction[i])));
        }
        Ok(Self { size, direction })
    }

    /// Size (px).
    pub fn size(&self) -> Size {
        self.size
    }

    /// HxW directions, row by row from the top.
    pub fn directions(&self) -> &[[f32; 3]] {
        &self.direction
    }

    /// The directions, for methods that write them. Writers keep them of unit length, or zero.
    pub fn directions_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_sizes_and_numbers_are_refused() {
        assert!(BentNormals::new(Size::px(2, 2), vec![[0.0; 3]; 3]).is_err());
        let nan = BentNormals::new(Size::px(2, 1), vec![[0.0; 3], [0.0, f32::NAN, 0.0]]).unwrap_err();
        assert!(nan.to_string().contains("(1, 0)"), "{nan}");
        let zeros = BentNormals::zeros(Size::px(2, 1));
        assert_eq!(BentNormals::new(Size::px(2, 1), vec![[0.0; 3]; 2]).unwrap(), zeros);
    }
}
