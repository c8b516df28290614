//! Whether a device has the gradients of the CPU. Kernels of a framework can be wrong on a device, and then a run learns nothing and
//! does not say so.

use super::optimizer::Gradients;
use super::samples::Crop;
use super::step::Stepper;
use aonet::internals::weights::Weights;
use aonet_scene::error::{Error, Result};

/// Largest difference of gradients, as a share of the CPU's. guess: far above rounding, far below a wrong kernel.
const MOST: f64 = 0.02;

/// Compares the gradients of a device with those of the CPU.
///
/// # Errors
/// When they differ by more than [`MOST`].
pub(crate) fn check(device: &Stepper, cpu: &Stepper, weights: &Weights, crops: &[Crop]) -> Result<()> {
    let [found, expected] = [device, cpu].map(|stepper| stepper.gradients(weights, crops).1);
    let difference = difference(&found, &expected);
    if difference <= MOST {
        return Ok(());
    }
    Err(Error::request(
        "training device",
        format!("the CPU's gradients to {:.0} %", 100.0 * MOST),
        format!(
            "gradients that differ by {:.0} %: it would learn nothing; train on the CPU",
            100.0 * difference
        ),
    ))
}

/// Length of the difference of two gradients over that of the second; NaN where a number is none.
fn difference(found: &Gradients, expected: &Gradients) -> f64 {
    let (mut difference, mut length) = (0.0, 0.0);
    for (name, expected) in expected {
        for (found, expected) in found[name].iter().zip(expected) {
            difference += f64::from(found - expected).powi(2);
            length += f64::from(*expected).powi(2);
        }
    }
    (difference / length).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradients(values: &[f32]) -> Gradients {
        [("head.weight".to_owned(), values.to_vec())].into()
    }

    #[test]
    fn differences_are_shares_of_the_expected_length() {
        let expected = gradients(&[3.0, 4.0]);
        assert_eq!(difference(&expected, &expected), 0.0);
        assert_eq!(difference(&gradients(&[3.0, 4.5]), &expected), 0.1);
        assert!(difference(&gradients(&[f32::NAN, 4.0]), &expected).is_nan());
    }
}
