//! The compiled part of the Python package `aonet`. It takes arrays that the Python part has checked and converted:
//! C-contiguous `float32`, which are borrowed, not copied.

mod camera;
mod errors;
mod files;
mod metrics;
mod names;
mod session;

use pyo3::prelude::*;

/// What `aonet` imports as `aonet._aonet`.
#[pymodule(gil_used = false)]
mod _aonet {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::files::{load_ao, load_exr, save_ao};
    #[pymodule_export]
    use crate::metrics::compare;
    #[pymodule_export]
    use crate::names::{methods, models, parameters, precisions};
    #[pymodule_export]
    use crate::session::Session;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
