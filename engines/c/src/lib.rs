//! The C library aonet: `include/aonet.h` describes what is here.

mod abi;
mod arguments;
mod failure;
mod frame;
mod names;
mod options;
mod pixels;
mod session;
#[cfg(test)]
mod tests;

use abi::{Code, Frame, SessionOptions};
use arguments::versioned;
use failure::{Failure, guarded, take_last};
use session::Handle;
use std::ffi::c_char;

/// Makes a session; null if that fails.
///
/// # Safety
/// `options` is null or points to `AonetSessionOptions` whose texts end with a zero byte and whose `weights` are
/// `weights_size` bytes.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub unsafe extern "C" fn aonetNewSession(options: *const SessionOptions) -> *mut Handle {
    guarded(|| {
        // SAFETY: the caller's promise.
        let choice = unsafe { options::read(versioned("AonetSessionOptions", options)?)? };
        Ok(Box::into_raw(Box::new(Handle::new(choice)?)))
    })
    .unwrap_or(std::ptr::null_mut())
}

/// Writes the visibility of a frame.
///
/// # Safety
/// `session` is null or a session that was not released. `frame` is null or points to `AonetFrame` whose images have the
/// pixels that their sizes and strides promise, and whose matrices have 16 numbers.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub unsafe extern "C" fn aonetRun(session: *const Handle, frame: *const Frame) -> Code {
    let result = guarded(|| {
        // SAFETY: the caller's promise.
        let session = unsafe { session.as_ref() }
            .ok_or_else(|| Failure::argument("session", "one that aonetNewSession returned", "NULL"))?;
        // SAFETY: the caller's promise.
        let frame = unsafe { versioned("AonetFrame", frame)? };
        // SAFETY: the caller's promise.
        unsafe { session.run(frame) }
    });
    result.map_or_else(|code| code, |()| Code::Ok)
}

/// Releases a session.
///
/// # Safety
/// `session` is null or a session that was not released and that no thread uses.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub unsafe extern "C" fn aonetReleaseSession(session: *mut Handle) {
    if session.is_null() {
        return;
    }
    // There is nobody to tell if this fails; aonetGetError has it.
    let _ = guarded(|| {
        // SAFETY: the caller's promise; `aonetNewSession` made it from a box.
        unsafe { Box::from_raw(session) }.release();
        Ok(())
    });
}

/// Returns the last error of this thread.
///
/// # Safety
/// `message` is null or points to a pointer that may be written.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub unsafe extern "C" fn aonetGetError(message: *mut *const c_char) -> Code {
    let (code, text) = take_last();
    if !message.is_null() {
        // SAFETY: the caller's promise.
        unsafe { message.write(text) };
    }
    code
}

/// The name of a network or classic method; null after the last one.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub extern "C" fn aonetGetMethodName(index: usize) -> *const c_char {
    guarded(|| Ok(names::all().get(index).map_or(std::ptr::null(), |name| name.as_ptr())))
        .unwrap_or(std::ptr::null())
}

/// Version of the library: 10000 * major + 100 * minor + patch.
#[unsafe(no_mangle)]
#[allow(unsafe_code, non_snake_case, reason = "a function of the C interface")]
pub extern "C" fn aonetGetVersion() -> u32 {
    names::VERSION
}
