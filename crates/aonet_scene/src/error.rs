//! The error of this crate: all of [`aonet::Error`], and errors about files.

use std::path::{Path, PathBuf};

/// Why an operation failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system reports an error about a file.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A file with unexpected contents.
    #[error("{}: expected {expected}, found {found}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the format or the command expects.
        expected: String,
        /// What the file contains.
        found: String,
    },
    /// A value from a file that the `aonet` crate refused.
    #[error("{}: {cause}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// The refusal.
        cause: aonet::Error,
    },
    /// A value that the `aonet` crate refused.
    #[error(transparent)]
    Core(#[from] aonet::Error),
    /// A request that cannot be met.
    #[error("{what}: expected {expected}, found {found}")]
    Request {
        /// The requested thing.
        what: String,
        /// What is possible.
        expected: String,
        /// What was requested or found.
        found: String,
    },
}

/// `std::result::Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Io`] about `path`, for `map_err`.
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |cause| Self::Io { path: path.to_owned(), cause }
    }

    /// An [`Error::InFile`] about `path`, for `map_err`.
    pub fn in_file(path: &Path) -> impl FnOnce(aonet::Error) -> Self + '_ {
        move |cause| Self::InFile { path: path.to_owned(), cause }
    }

    /// An [`Error::File`] from anything that can be shown.
    pub fn file(path: &Path, expected: impl ToString, found: impl ToString) -> Self {
        Self::File { path: path.to_owned(), expected: expected.to_string(), found: found.to_string() }
    }

    /// An [`Error::Request`] from anything that can be shown.
    pub fn request(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Request { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }
}
