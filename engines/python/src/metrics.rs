//! SSIM and PSNR.

use crate::errors;
use crate::session::elements;
use aonet::metrics::{self, Scores};
use aonet::{AoImage, Size};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// SSIM, SSIM 8x8, mean squared error, PSNR and number of pixels.
type Row = (f64, f64, f64, f64, usize);

/// Compares `image` with `reference` over all pixels, and over those of the mask.
#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    reference: PyReadonlyArray2<'_, f32>,
    image: PyReadonlyArray2<'_, f32>,
    mask: Option<PyReadonlyArray2<'_, bool>>,
) -> PyResult<(Row, Option<Row>)> {
    let (a, b) = (ao_image("reference", &reference)?, ao_image("image", &image)?);
    let mask = mask.as_ref().map(|mask| elements("mask", mask)).transpose()?;
    let found = errors::detached(py, || metrics::compare(&a, &b, mask))?.map_err(errors::value)?;
    let row = |s: Scores| (s.ssim, s.ssim_8x8, s.mse, s.psnr, s.pixels);
    Ok((row(found.full), found.foreground.map(row)))
}

/// A copy of an array as an AO image.
pub(crate) fn ao_image(name: &str, array: &PyReadonlyArray2<'_, f32>) -> PyResult<AoImage> {
    let &[height, width] = array.shape() else { return Err(errors::wrong(name, "two axes", array.ndim())) };
    let size = Size::named(name, width, height).map_err(errors::value)?;
    let image = AoImage::new(size, elements(name, array)?.to_vec());
    image.map_err(|error| match error {
        aonet::Error::Value { what, expected, found } => {
            errors::wrong(&format!("{name}: {what}"), expected, found)
        }
        other => errors::value(other),
    })
}
