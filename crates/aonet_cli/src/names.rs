//! Names of files to write: a wrong extension is refused before the work.

use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// Takes names that end in `.exr`.
pub(crate) fn exr() -> impl TypedValueParser<Value = PathBuf> {
    ending("exr")
}

/// Takes names that end in `.png`.
pub(crate) fn png() -> impl TypedValueParser<Value = PathBuf> {
    ending("png")
}

/// Takes names that end in the extension, in any case.
pub(crate) fn ending(extension: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| match has(&path, extension) {
        true => Ok(path),
        false => Err(format!("expected a name that ends in .{extension}")),
    })
}

fn has(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
