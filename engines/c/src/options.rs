//! `AonetSessionOptions`, checked.
#![allow(unsafe_code, reason = "reads memory of a C program")]

use crate::abi::{Code, SessionOptions};
use crate::arguments::text;
use crate::failure::{Failure, Result};
use crate::names;
use aonet::frame::MAX_SIDE;
use aonet::net::cpu::Precision;
use aonet::net::{Model, shipped};
use aonet::search::Classic;
use aonet::{Margin, Size, Window};
use std::ffi::{CStr, c_int};
use std::path::Path;

/// More than any machine has use for.
const MOST_THREADS: usize = 1024;

/// What a session is made of.
pub(crate) struct Choice {
    pub(crate) method: Method,
    pub(crate) window: Window,
    pub(crate) threads: usize,
}

/// What computes visibility.
pub(crate) enum Method {
    Network(Box<Model>, Precision),
    Classic(Classic),
}

/// Reads options; loads weights.
///
/// # Errors
/// When a field is out of its range, weights cannot be read, or the machine lacks instructions.
///
/// # Safety
/// Texts end with a zero byte, and `weights` are `weights_size` bytes.
pub(crate) unsafe fn read(options: &SessionOptions) -> Result<Choice> {
    let size = Size::named("width and height", options.width, options.height)?;
    let margin = Margin { x: options.margin_x, y: options.margin_y };
    let window = Window::new(size, margin).map_err(|_| {
        let found = format!("{} columns and {} rows around {size}", margin.x, margin.y);
        Failure::argument("margin", format!("at most {MAX_SIDE} pixels a side with the picture"), found)
    })?;
    let threads = threads(options.threads)?;
    let precision = precision(options.precision)?;
    // SAFETY: the caller's promise.
    let method = match unsafe { source(options)? } {
        Source::Name(name) => named(name, precision)?,
        Source::Path(path) => Method::Network(Box::new(model_file(path)?), precision),
        Source::Bytes(bytes) => Method::Network(Box::new(model(bytes)?), precision),
    };
    Ok(Choice { method, window, threads })
}

/// Where a method comes from.
enum Source<'a> {
    Name(&'a CStr),
    Path(&'a CStr),
    Bytes(&'a [u8]),
}

/// # Safety
/// As [`read`].
unsafe fn source(options: &SessionOptions) -> Result<Source<'_>> {
    // SAFETY: the caller's promise.
    let (name, path) = unsafe { (text(options.method), text(options.weights_path)) };
    match (name, path, options.weights.is_null()) {
        (None, None, true) if options.weights_size != 0 => {
            Err(Failure::argument("weights", "bytes, as weights_size is not 0", "NULL"))
        }
        (None, None, true) => Ok(Source::Name(c"balanced")),
        (Some(name), None, true) => Ok(Source::Name(name)),
        (None, Some(path), true) => Ok(Source::Path(path)),
        (None, None, false) if options.weights_size > isize::MAX as usize => {
            Err(Failure::argument("weights_size", "bytes that fit in memory", options.weights_size))
        }
        (None, None, false) => {
            // SAFETY: the caller's promise; the pointer is not null and the length is that of an object.
            let bytes =
                unsafe { std::slice::from_raw_parts(options.weights.cast::<u8>(), options.weights_size) };
            Ok(Source::Bytes(bytes))
        }
        _ => Err(Failure::argument("method", "at most one of method, weights_path and weights", "more")),
    }
}

fn named(name: &CStr, precision: Precision) -> Result<Method> {
    let text = name.to_string_lossy();
    if let Some((_, bytes)) = shipped::ALL.into_iter().find(|(network, _)| *network == text) {
        return Ok(Method::Network(Box::new(model(bytes)?), precision));
    }
    if !names::all().iter().any(|known| known.as_c_str() == name) {
        let names: Vec<_> = names::all().iter().map(|known| known.to_string_lossy()).collect();
        return Err(Failure::argument("method", format!("one of {}", names.join(", ")), text));
    }
    if precision != Precision::F32 {
        return Err(Failure::argument("precision of a classic method", Precision::F32, precision));
    }
    Ok(Method::Classic(Classic::named(&text)?))
}

fn model(bytes: &[u8]) -> Result<Model> {
    Model::from_bytes(bytes).map_err(|error| Failure::from(error).with_code(Code::InvalidWeights))
}

fn model_file(path: &CStr) -> Result<Model> {
    let path = of_bytes(path);
    let unread = |found: String| {
        let what = format!("weights file {}", path.display());
        Failure::new(Code::InvalidWeights, &what, "a file that can be read", found)
    };
    match std::fs::metadata(&path) {
        Ok(file) if !file.is_file() => return Err(unread("something that is not a file".into())),
        Ok(_) => {}
        Err(error) => return Err(unread(error.to_string())),
    }
    let bytes = std::fs::read(&path).map_err(|error| unread(error.to_string()))?;
    Model::from_bytes(&bytes).map_err(|error| {
        Failure::new(Code::InvalidWeights, &format!("weights file {}", path.display()), "a network", error)
    })
}

#[cfg(unix)]
fn of_bytes(path: &CStr) -> std::borrow::Cow<'_, Path> {
    use std::os::unix::ffi::OsStrExt;
    Path::new(std::ffi::OsStr::from_bytes(path.to_bytes())).into()
}

#[cfg(not(unix))]
fn of_bytes(path: &CStr) -> std::borrow::Cow<'_, Path> {
    std::path::PathBuf::from(path.to_string_lossy().into_owned()).into()
}

/// The chosen precision. Networks of a machine without instructions for it cannot be made.
fn precision(choice: c_int) -> Result<Precision> {
    let precision = match choice {
        0 => Precision::F32,
        1 => return Ok(Precision::fastest()),
        2 => Precision::Bf16,
        3 => Precision::Int8,
        _ => return Err(Failure::argument("precision", "an AonetPrecision, 0 to 3", choice)),
    };
    if Precision::available().any(|available| available == precision) {
        return Ok(precision);
    }
    let names: Vec<_> = Precision::available().map(|available| available.to_string()).collect();
    let expected = format!("one that this machine has instructions for ({})", names.join(", "));
    Err(Failure::new(Code::UnsupportedHardware, "precision", expected, precision))
}

fn threads(threads: usize) -> Result<usize> {
    match threads {
        0 => Ok(std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS)),
        1..=MOST_THREADS => Ok(threads),
        _ => Err(Failure::argument("threads", format!("a number in 0..={MOST_THREADS}"), threads)),
    }
}
