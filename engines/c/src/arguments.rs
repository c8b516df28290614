//! Pointers of a C program, checked as far as pointers can be.
#![allow(unsafe_code, reason = "reads memory of a C program")]

use crate::failure::{Failure, Result};
use std::ffi::{CStr, c_char};

/// A struct that begins with its own size.
///
/// # Errors
/// When the pointer is null or not aligned, or the struct has another size than this library knows.
///
/// # Safety
/// `pointer` is null or points to a size in bytes and, if that is the size of `T`, to a `T`. It stays valid for `'a`.
pub(crate) unsafe fn versioned<'a, T>(name: &str, pointer: *const T) -> Result<&'a T> {
    if pointer.is_null() || !pointer.is_aligned() {
        let found = if pointer.is_null() { "NULL" } else { "a pointer that is not aligned" };
        return Err(Failure::argument(name, format!("a pointer to {name}"), found));
    }
    // SAFETY: the caller's promise: every such struct begins with its size.
    let found = unsafe { pointer.cast::<usize>().read() };
    if found != size_of::<T>() {
        let expected =
            format!("{} (sizeof({name}) of version {})", size_of::<T>(), env!("CARGO_PKG_VERSION"));
        return Err(Failure::argument(&format!("struct_size of {name}"), expected, found));
    }
    // SAFETY: the caller's promise, as the size is that of `T`.
    Ok(unsafe { &*pointer })
}

/// A text; none for a null pointer.
///
/// # Safety
/// `text` is null or ends with a zero byte. It stays valid for `'a`.
pub(crate) unsafe fn text<'a>(text: *const c_char) -> Option<&'a CStr> {
    // SAFETY: the caller's promise.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) })
}

/// A column-major matrix; none for a null pointer.
///
/// # Errors
/// When the pointer is not aligned.
///
/// # Safety
/// `numbers` is null or points to 16 numbers.
pub(crate) unsafe fn matrix(name: &str, numbers: *const f32) -> Result<Option<[[f32; 4]; 4]>> {
    if !numbers.is_aligned() {
        return Err(Failure::argument(name, "a pointer to 16 floats", "one that is not aligned to 4 bytes"));
    }
    // SAFETY: the caller's promise.
    Ok((!numbers.is_null()).then(|| unsafe { numbers.cast::<[[f32; 4]; 4]>().read() }))
}

/// Room for so many values, without aborting where there is none.
///
/// # Errors
/// When there is not enough memory.
pub(crate) fn filled<T: Clone>(what: &str, len: usize, value: T) -> Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(len).map_err(|_| Failure::memory(what, len.saturating_mul(size_of::<T>())))?;
    values.resize(len, value);
    Ok(values)
}
