//! The error of this crate: everything of [`aonet::Error`], and files.

use std::path::{Path, PathBuf};

/// Why an offline operation could not be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused something about a file.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file that does not hold what it should.
    #[error("{}: expected {expected}, found {found}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the format or the command asks for.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// A value that the `aonet` crate refused; with the file it came from.
    #[error("{}: {cause}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What was refused.
        cause: aonet::Error,
    },
    /// A value that the `aonet` crate refused.
    #[error(transparent)]
    Core(#[from] aonet::Error),
    /// A request that cannot be met.
    #[error("{what}: expected {expected}, found {found}")]
    Request {
        /// The thing asked for.
        what: String,
        /// What is possible.
        expected: String,
        /// What was asked or found.
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
