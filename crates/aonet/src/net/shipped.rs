//! The trained networks that come with the crate, as bytes for [`Model::from_bytes`](super::Model::from_bytes).

/// Normals, projected radius and a horizon search, which it corrects: any AO radius, any unit. The better one; use this.
pub const ANY_RADIUS: &[u8] = include_bytes!("../../models/any_radius.safetensors");

/// Normals only, as in the paper: knows the one radius that it was trained with, relative to the scene.
pub const PAPER: &[u8] = include_bytes!("../../models/paper.safetensors");

#[cfg(test)]
mod tests {
    use super::super::{Features, Model};

    #[test]
    fn shipped_models_load_and_stay_small() {
        for (bytes, features) in
            [(super::ANY_RADIUS, Features::normal_radius_horizon()), (super::PAPER, Features::normal())]
        {
            let model = Model::from_bytes(bytes).unwrap();
            assert_eq!(model.config().features, features);
            assert!(bytes.len() < 1_500_000, "{} bytes", bytes.len());
            assert!(model.facts().mean_visibility.is_some() && model.facts().steps > 0);
        }
    }
}
