//! Whether CUDA works. The framework panics where it does not.

use aonet_scene::error::{Error, Result};
use burn::tensor::{Device, Tensor};
use std::panic;
use std::sync::{Arc, Mutex};

/// Letters of a panic's message that an error repeats. Messages list every name of a library that was looked for.
const MOST_LETTERS: usize = 120;

/// Computes one number on the first NVIDIA GPU.
///
/// # Errors
/// When that does not work, with the beginning of the framework's message.
pub(crate) fn check() -> Result<()> {
    let message = Arc::new(Mutex::new(String::new()));
    let (heard, usual) = (Arc::clone(&message), panic::take_hook());
    panic::set_hook(Box::new(move |info| {
        let mut first = heard.lock().unwrap_or_else(|e| e.into_inner());
        if first.is_empty() {
            let text = info.payload_as_str().unwrap_or("a panic without a message");
            *first = text.chars().take(MOST_LETTERS).collect();
        }
    }));
    let one = panic::catch_unwind(|| Tensor::<1>::ones([1], &Device::cuda(0)).into_scalar::<f32>());
    panic::set_hook(usual);
    match one {
        Ok(1.0) => Ok(()),
        Ok(other) => Err(wrong(&format!("the number {other} instead of 1"))),
        Err(_) => Err(wrong(&message.lock().unwrap_or_else(|e| e.into_inner()))),
    }
}

fn wrong(found: &str) -> Error {
    let expected = "an NVIDIA GPU, its driver (libcuda), and NVRTC and headers of a CUDA toolkit (CUDA_PATH)";
    Error::request("training on CUDA", expected, found)
}

#[cfg(test)]
mod tests {
    /// Without a GPU, which is how the tests run as a rule.
    #[test]
    fn a_machine_without_cuda_is_an_error() {
        match super::check() {
            Ok(()) => eprintln!("skipped: CUDA works here"),
            Err(error) => {
                assert!(error.to_string().contains("training on CUDA: expected an NVIDIA GPU"), "{error}")
            }
        }
    }
}
