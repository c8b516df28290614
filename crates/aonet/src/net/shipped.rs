//! The trained networks that come with the crate, as bytes for [`Model::from_bytes`](super::Model::from_bytes).

/// A horizon search and a small network that corrects it, without a survey.
pub const FAST: &[u8] = include_bytes!("../../models/fast.safetensors");

/// Normals, projected radius, a horizon search, which it corrects, and a survey of the light that is hidden or off the frame: any AO radius,
/// any unit. It reads guard band and second layer where frames have them.
pub const BALANCED: &[u8] = include_bytes!("../../models/balanced.safetensors");

/// Sees the shares of light of every pixel, as connected arcs find them, and weighs each; smaller patches and a larger network than `balanced`.
/// The best one, and the slowest.
pub const HIGH: &[u8] = include_bytes!("../../models/high.safetensors");

/// Normals only, as in the paper: knows the one radius that it was trained with, relative to the scene.
pub const PAPER: &[u8] = include_bytes!("../../models/paper.safetensors");

/// All of them by name.
pub const ALL: [(&str, &[u8]); 4] =
    [("fast", FAST), ("balanced", BALANCED), ("high", HIGH), ("paper", PAPER)];

#[cfg(test)]
mod tests {
    use super::super::{Features, Model};

    #[test]
    fn shipped_models_load_and_stay_small() {
        let horizon = Features::normal_radius_horizon;
        let features = [horizon(), horizon(), Features::normal_radius_light(), Features::normal()];
        for ((name, bytes), features) in super::ALL.into_iter().zip(features) {
            let model = Model::from_bytes(bytes).unwrap();
            assert_eq!(model.config().features, features, "{name}");
            assert_eq!(model.config().survey.is_some(), name == "balanced", "{name}");
            assert!(bytes.len() < 1_500_000, "{name}: {} bytes", bytes.len());
            assert!(model.facts().mean_visibility.is_some() && model.facts().steps > 0, "{name}");
        }
    }
}
