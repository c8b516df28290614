//! Errors of a device as values.

use crate::error::{Error, Result};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Returns what `make` returns, or an error about `what` where the device reports one.
///
/// Browsers report such errors later, to the device's own handler.
///
/// # Errors
/// Those of `make`, and those of the device: something is invalid, or memory is short.
pub fn scoped<T>(device: &wgpu::Device, what: &str, make: impl FnOnce() -> Result<T>) -> Result<T> {
    use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
    if cfg!(target_arch = "wasm32") {
        return make();
    }
    let scopes = [Validation, OutOfMemory, Internal].map(|filter| device.push_error_scope(filter));
    let made = make();
    let mut found = None;
    for scope in scopes.into_iter().rev() {
        if let Poll::Ready(error) = pin!(scope.pop()).poll(&mut Context::from_waker(Waker::noop())) {
            found = found.or(error);
        }
    }
    match found {
        Some(error @ wgpu::Error::OutOfMemory { .. }) => Err(Error::device(what, "enough memory", error)),
        Some(error) => Err(Error::device(what, "what the device accepts", error)),
        None => made,
    }
}

/// Refuses devices with limits below WebGPU's defaults: the shaders need these.
pub(crate) fn check_limits(limits: &wgpu::Limits) -> Result<()> {
    let needed = wgpu::Limits::defaults();
    for (what, least, found) in [
        (
            "storage buffers of a shader",
            needed.max_storage_buffers_per_shader_stage,
            limits.max_storage_buffers_per_shader_stage,
        ),
        (
            "invocations of a workgroup",
            needed.max_compute_invocations_per_workgroup,
            limits.max_compute_invocations_per_workgroup,
        ),
        (
            "bytes of memory of a workgroup",
            needed.max_compute_workgroup_storage_size,
            limits.max_compute_workgroup_storage_size,
        ),
        (
            "workgroups of a dimension",
            needed.max_compute_workgroups_per_dimension,
            limits.max_compute_workgroups_per_dimension,
        ),
    ] {
        if found < least {
            return Err(Error::device(what, format!("at least {least}"), found));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_made_for_less_than_webgpu_promises_are_refused() {
        assert!(check_limits(&wgpu::Limits::defaults()).is_ok());
        let error = check_limits(&wgpu::Limits::downlevel_defaults()).unwrap_err().to_string();
        assert!(error.contains("storage buffers") && error.contains("at least 8"), "{error}");
    }
}
