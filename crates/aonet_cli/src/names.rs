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

/// Takes names that end in `.exr` or `.png`.
pub(crate) fn exr_or_png() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match has(&path, "exr") || has(&path, "png") {
        true => Ok(path),
        false => Err("expected a name that ends in .exr or .png"),
    })
}

/// Takes names that end in the extension, in any case.
pub(crate) fn ending(extension: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| checked(path, extension))
}

/// The name, if it ends in the extension.
///
/// # Errors
/// When it does not.
pub(crate) fn checked(path: PathBuf, extension: &str) -> Result<PathBuf, String> {
    if has(&path, extension) { Ok(path) } else { Err(format!("expected a name that ends in .{extension}")) }
}

fn has(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}
