//! The error of this crate. Every variant names the thing, what was expected and what was found.

/// Why an operation could not be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A size that cannot hold an image.
    #[error("{what}: expected {expected}, found {found}")]
    Size {
        /// What has the size.
        what: String,
        /// The sizes that are accepted.
        expected: String,
        /// The size that was given.
        found: String,
    },
    /// A value outside its domain, such as a radius of zero or a NaN depth.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// What holds the value, with a pixel position where there is one.
        what: String,
        /// The domain.
        expected: String,
        /// The value that was given.
        found: String,
    },
    /// Bytes that are not the format they should be.
    #[error("{what}: expected {expected}, found {found}")]
    Format {
        /// Which file or section.
        what: String,
        /// What the format asks for.
        expected: String,
        /// What the bytes hold.
        found: String,
    },
    /// A configuration that no network can be built from.
    #[error("model config: {what}: expected {expected}, found {found}")]
    Config {
        /// Which field.
        what: String,
        /// What the field accepts.
        expected: String,
        /// What was given.
        found: String,
    },
    /// A weights file and a network that do not belong together.
    #[error("weights: {what}: expected {expected}, found {found}")]
    Weights {
        /// Which tensor or metadata entry.
        what: String,
        /// What the network asks for.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// A graphics device that lacks or refuses something.
    #[error("device: {what}: expected {expected}, found {found}")]
    Device {
        /// Which ability, limit or object.
        what: String,
        /// What is needed.
        expected: String,
        /// What the device has or says.
        found: String,
    },
}

/// `std::result::Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A [`Error::Value`] from anything that can be shown.
    pub fn value(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Value { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A [`Error::Size`] from anything that can be shown.
    pub fn size(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Size { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A [`Error::Format`] from anything that can be shown.
    pub fn format(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Format { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A [`Error::Config`] from anything that can be shown.
    pub fn config(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Config { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A [`Error::Weights`] from anything that can be shown.
    pub fn weights(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Weights { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }

    /// A [`Error::Device`] from anything that can be shown.
    pub fn device(what: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Device { what: what.to_string(), expected: expected.to_string(), found: found.to_string() }
    }
}
