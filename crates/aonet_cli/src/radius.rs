//! The AO radius of the command line, and whether networks were trained with it.

use crate::output;
use anyhow::{Context, Result};
use aonet::net::Model;
use aonet::{AoParams, GBuffer};
use aonet_lab::eval::phenomena::projected_radius;
use aonet_lab::eval::radius_range;

/// Factor on both ends of the trained range before a radius is warned of: then the three digits of the message differ from the end.
const SLACK: f32 = 1.005;

/// The given radius, else another one (world units).
///
/// # Errors
/// Names the option when the given radius is out of range.
pub(crate) fn given_or(given: Option<f32>, otherwise: f32) -> Result<f32> {
    match given {
        Some(radius) => Ok(AoParams::new(radius).context("--radius")?.radius()),
        None => Ok(otherwise),
    }
}

/// Says on stderr that a network was not trained with the radius of a frame, or that it ignores the `given` one.
pub(crate) fn check(
    (name, model): (&str, &Model),
    (gbuffer, params): (&GBuffer, AoParams),
    given: Option<f32>,
) {
    if let (false, Some(radius)) = (model.config().features.sees_radius(), given) {
        output::note(&format!(
            "note: the network {name} does not see the AO radius: --radius {radius:?} does not change its image"
        ));
        return;
    }
    // The image's height is the picture's, without a guard band.
    let share = projected_radius(&gbuffer.without_margin(), params);
    let (Some(range), Some(share)) = (radius_range(model), share) else { return };
    if share < range.start() / SLACK || share > range.end() * SLACK {
        let [low, high] = [range.start(), range.end()].map(|end| 100.0 * end);
        output::note(&format!(
            "warning: the AO radius is {} % of the image's height at the median depth; the network {name} was trained with {low} to {high} %",
            percent(share)
        ));
    }
}

/// A share in percent with three digits.
fn percent(share: f32) -> String {
    let percent = 100.0 * f64::from(share);
    if !(0.001..1e4).contains(&percent) {
        return format!("{percent:.2e}");
    }
    let decimals = (2.0 - percent.log10().floor()).max(0.0) as usize;
    format!("{percent:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_have_three_digits() {
        let shares = [0.016, 0.0198, 0.402, 1.0, 3.1e-6, 2.35e29, 1e-9];
        let expected = ["1.60", "1.98", "40.2", "100", "3.10e-4", "2.35e31", "1.00e-7"];
        assert_eq!(shares.map(percent), expected);
    }
}
