//! A camera as Python sees it: matrices are lists of rows.

use crate::errors;
use aonet::frame::ClipDepth;
use aonet::{Projection, Size};
use pyo3::prelude::*;

/// A matrix as a list of rows, for column vectors.
type Rows = [[f32; 4]; 4];

/// The camera of a picture, without its guard band.
#[pyclass(frozen, module = "aonet._aonet")]
pub(crate) struct Camera {
    pub(crate) of_picture: aonet::Camera,
}

#[pymethods]
impl Camera {
    /// A camera with a vertical field of view in degrees.
    #[staticmethod]
    fn perspective(width: usize, height: usize, fov_y: f32) -> PyResult<Self> {
        let projection = Projection::Perspective { fov_y: fov_y.to_radians() };
        let camera = aonet::Camera::new(projection, size(width, height)?);
        let wrong = |_| errors::wrong("fov_y", "an angle in (0, 180) degrees", fov_y);
        Ok(Self { of_picture: camera.map_err(wrong)? })
    }

    /// The camera of a projection matrix. Its third row, which maps depth, is not read.
    #[staticmethod]
    fn of_projection(width: usize, height: usize, projection: Rows) -> PyResult<Self> {
        let wrong = errors::of_argument("projection");
        let camera = aonet::Camera::from_clip_from_view(
            transposed(with_plain_depth(projection)),
            ClipDepth::ZeroToOne,
            size(width, height)?,
        );
        Ok(Self { of_picture: camera.map_err(wrong)? })
    }

    /// The same camera with a rigid transform from world to view space.
    fn with_view(&self, view: Rows) -> PyResult<Self> {
        let posed = self.of_picture.with_view_from_world(transposed(view));
        Ok(Self { of_picture: posed.map_err(errors::of_argument("view"))? })
    }

    /// Vertical field of view in degrees; None for an orthographic camera.
    #[getter]
    fn fov_y(&self) -> Option<f32> {
        match self.of_picture.projection() {
            Projection::Perspective { fov_y } => Some(fov_y.to_degrees()),
            Projection::Orthographic { .. } => None,
        }
    }

    /// The projection matrix: reversed depth in [0, 1], with the far plane at infinity for a perspective camera and at
    /// distance 1 for an orthographic one.
    #[getter]
    fn projection(&self) -> Rows {
        let camera = &self.of_picture;
        let half = [0.5 * camera.width() as f32, 0.5 * camera.height() as f32];
        let ([fx, fy], [cx, cy]) = (camera.focal_px(), camera.centre_px());
        let (scale, axis) = ([fx / half[0], fy / half[1]], [cx / half[0] - 1.0, 1.0 - cy / half[1]]);
        match camera.is_perspective() {
            true => [
                [scale[0], 0.0, -axis[0], 0.0],
                [0.0, scale[1], -axis[1], 0.0],
                [0.0, 0.0, 0.0, camera.near()],
                [0.0, 0.0, -1.0, 0.0],
            ],
            false => [
                [scale[0], 0.0, 0.0, axis[0]],
                [0.0, scale[1], 0.0, axis[1]],
                [0.0, 0.0, 1.0, 1.0],
                [0.0, 0.0, 0.0, 1.0],
            ],
        }
    }

    /// The transform from world to view space.
    #[getter]
    fn view(&self) -> Rows {
        transposed(glam::Mat4::from(self.of_picture.view_from_world()).to_cols_array_2d())
    }
}

fn size(width: usize, height: usize) -> PyResult<Size> {
    Size::named("picture", width, height).map_err(errors::value)
}

fn transposed(m: Rows) -> Rows {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

/// The same matrix with a third row that has a near plane: which range of depths a program uses does not matter here.
fn with_plain_depth([x, y, _, w]: Rows) -> Rows {
    let is_perspective = w[3] == 0.0;
    [x, y, if is_perspective { [0.0, 0.0, 0.0, 1.0] } else { [0.0, 0.0, -1.0, 0.0] }, w]
}
