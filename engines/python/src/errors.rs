//! Errors as Python exceptions. The texts are those of the crates: what, what was expected, what was found.

use aonet_scene::Error as FileError;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A `ValueError` with the error's own text.
pub(crate) fn value(error: aonet::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A `ValueError` that names an argument of the Python function instead of what the crate calls it.
pub(crate) fn of_argument(name: &str) -> impl FnOnce(aonet::Error) -> PyErr + '_ {
    move |error| match error {
        aonet::Error::Value { expected, found, .. } => wrong(name, expected, found),
        other => value(other),
    }
}

/// A `ValueError` about an argument.
pub(crate) fn wrong(name: &str, expected: impl ToString, found: impl ToString) -> PyErr {
    PyValueError::new_err(format!("{name}: expected {}, found {}", expected.to_string(), found.to_string()))
}

/// An `OSError` where the operating system refuses a file, else a `ValueError` with the file's name.
pub(crate) fn file(error: FileError) -> PyErr {
    match error {
        FileError::Io { path, cause } => match cause.raw_os_error() {
            // Python chooses the class by the code, such as FileNotFoundError.
            Some(code) => PyOSError::new_err((code, without_code(&cause), path.into_os_string())),
            None => PyOSError::new_err(format!("{}: {cause}", path.display())),
        },
        other => PyValueError::new_err(other.to_string()),
    }
}

/// The system's text without "(os error 2)", as Python writes the code itself.
fn without_code(cause: &std::io::Error) -> String {
    let text = cause.to_string();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}

/// Runs `work` while other Python threads run. A panic, which would be a fault of this package, becomes a `RuntimeError`.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic");
        PyRuntimeError::new_err(format!("fault in aonet: {text}"))
    })
}
