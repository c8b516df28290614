//! Frames and AO images as files.

use crate::camera::Camera;
use crate::{errors, metrics};
use aonet_lab::ao_file;
use aonet_lab::frame::{Frame, FrameHints, NormalSpace};
use aonet_scene::View;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;

type Image<'py> = Bound<'py, PyArray2<f32>>;

/// Camera, normals, depth, second depth, AO, margin (columns, rows) and radius of a frame.
type Loaded<'py> = (
    Camera,
    Bound<'py, PyArray3<f32>>,
    Image<'py>,
    Option<Image<'py>>,
    Option<Image<'py>>,
    (usize, usize),
    Option<f32>,
);

/// Reads a frame. `normals` is "view", "world" or "blender", and by default what the names of the channels say.
#[pyfunction]
pub(crate) fn load_exr<'py>(
    py: Python<'py>,
    path: PathBuf,
    second: Option<PathBuf>,
    view: Option<PathBuf>,
    fov_y: Option<f32>,
    radius: Option<f32>,
    normals: Option<&str>,
) -> PyResult<Loaded<'py>> {
    let normals = normals.map(normal_space).transpose()?;
    let load = || {
        let view = view.map(|view| View::load(&view)).transpose()?;
        let hints = FrameHints { view, fov_y_deg: fov_y, radius, normals };
        match second {
            Some(second) => Frame::load_with_second(&path, &second, &hints),
            None => Frame::load(&path, &hints),
        }
    };
    let Frame { gbuffer, ao, radius, .. } = errors::detached(py, load)?.map_err(errors::file)?;
    let (window, size) = (gbuffer.window(), gbuffer.size());
    let of_buffer = |values: &[f32]| PyArray1::from_slice(py, values).reshape([size.height(), size.width()]);
    let normal = PyArray1::from_slice(py, gbuffer.normal().as_flattened());
    let second = gbuffer.second().map(|second| of_buffer(&second.depth)).transpose()?;
    let ao = ao.map(|ao| PyArray1::from_slice(py, ao.visibility()).reshape([ao.height(), ao.width()]));
    Ok((
        Camera { of_picture: *gbuffer.without_margin().camera() },
        normal.reshape([size.height(), size.width(), 3])?,
        of_buffer(gbuffer.depth())?,
        second,
        ao.transpose()?,
        (window.margin().x, window.margin().y),
        radius,
    ))
}

fn normal_space(name: &str) -> PyResult<NormalSpace> {
    match name {
        "view" => Ok(NormalSpace::View),
        "world" => Ok(NormalSpace::World),
        "blender" => Ok(NormalSpace::BlenderWorld),
        other => Err(errors::wrong("normals", "'view', 'world' or 'blender'", format!("'{other}'"))),
    }
}

/// Reads an AO image: .exr or .png.
#[pyfunction]
pub(crate) fn load_ao(py: Python<'_>, path: PathBuf) -> PyResult<Image<'_>> {
    let ao = errors::detached(py, || ao_file::load_ao(&path))?.map_err(errors::file)?;
    PyArray1::from_slice(py, ao.visibility()).reshape([ao.height(), ao.width()])
}

/// Writes an AO image: .exr (32-bit) or .png (16-bit grey, linear).
#[pyfunction]
pub(crate) fn save_ao(py: Python<'_>, path: PathBuf, image: PyReadonlyArray2<'_, f32>) -> PyResult<()> {
    let image = metrics::ao_image("image", &image)?;
    errors::detached(py, || ao_file::save_ao(&path, &image))?.map_err(errors::file)
}
