//! Configurations as files hold them, and what old files meant.

use super::{Arch, Channel, Features, KernelWeights, ModelConfig, Output, SearchConfig, Skips};
use crate::error::{Error, Result};
use crate::search::{AgtaoParams, ArcsParams};
use serde::Deserialize;

/// The search of every network whose file names its features by one name: such files do not hold the parameters.
pub(super) const SEARCH_OF_OLD_FILES: SearchConfig = SearchConfig::Agtao(AgtaoParams {
    slices: 3,
    steps: 6,
    radius_scale: 1.348_342_2,
    follow: 0.0,
    attenuation: 0.741_921_25,
    angle_bias: 2.367_428,
    distribution: 1.872_475_7,
    power: 1.366_998_1,
    denoise_passes: 1,
    denoise_plane: 0.015_295_454,
    denoise_normal: 5.945_274_4,
    denoise_keep: 0.0,
});

/// A [`ModelConfig`] as JSON, of today or older.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ConfigFile {
    arch: Arch,
    features: FeaturesOfFile,
    patch: usize,
    kernel: KernelOfFile,
    output: Option<Output>,
    search: Option<SearchConfig>,
    survey: Option<ArcsParams>,
    embedding: Option<usize>,
    encoder: Vec<usize>,
    decoder: Vec<usize>,
    #[serde(default)]
    skips: Skips,
    #[serde(default)]
    neighbours: Vec<usize>,
    #[serde(default)]
    smooth: bool,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum FeaturesOfFile {
    OldName(String),
    Channels(Vec<Channel>),
}

/// [`KernelWeights`], and `correction`, which was one of them.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum KernelOfFile {
    Off,
    Correction,
    Linear,
    Softmax,
}

impl TryFrom<ConfigFile> for ModelConfig {
    type Error = Error;

    fn try_from(file: ConfigFile) -> Result<Self> {
        let (features, is_old) = match file.features {
            FeaturesOfFile::OldName(name) => (Features::of_old_name(&name)?, true),
            FeaturesOfFile::Channels(channels) => (Features::new(channels), false),
        };
        let (kernel, output_of_kernel) = match file.kernel {
            KernelOfFile::Off => (KernelWeights::Off, Output::Visibility),
            KernelOfFile::Correction => (KernelWeights::Off, Output::Correction),
            KernelOfFile::Linear => (KernelWeights::Linear, Output::Visibility),
            KernelOfFile::Softmax => (KernelWeights::Softmax, Output::Visibility),
        };
        let search_of_old = (is_old && features.horizon().is_some()).then_some(SEARCH_OF_OLD_FILES);
        Ok(Self {
            arch: file.arch,
            features,
            patch: file.patch,
            kernel,
            output: file.output.unwrap_or(output_of_kernel),
            search: file.search.or(search_of_old),
            survey: file.survey,
            embedding: file.embedding,
            encoder: file.encoder,
            decoder: file.decoder,
            skips: file.skips,
            neighbours: file.neighbours,
            smooth: file.smooth,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The configuration of a network that corrects a search, as files of format 1 hold it.
    const OLD: &str = r#"{"arch": "ao_net", "features": "normal_radius_horizon", "patch": 4, "kernel": "correction",
        "encoder": [32, 48, 64, 64, 48], "decoder": [48, 56, 48, 32]}"#;

    fn config(json: &str) -> std::result::Result<ModelConfig, serde_json::Error> {
        serde_json::from_str(json)
    }

    #[test]
    fn old_files_mean_what_they_meant() {
        let old = config(OLD).unwrap();
        assert_eq!(old.features, Features::normal_radius_horizon());
        assert_eq!((old.kernel, old.output), (KernelWeights::Off, Output::Correction));
        assert_eq!(old.search, Some(SEARCH_OF_OLD_FILES));
        assert_eq!(old, ModelConfig { search: old.search, ..ModelConfig::correcting() });
        for name in ["normal", "normal_encoded", "normal_depth", "normal_projected_radius"] {
            let json = OLD.replace("normal_radius_horizon", name).replace("correction", "linear");
            let config = config(&json).unwrap();
            assert_eq!((config.output, config.search), (Output::Visibility, None), "{name}");
        }
    }

    #[test]
    fn configurations_round_trip() {
        for written in [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_shading()] {
            let json = serde_json::to_string(&written).unwrap();
            assert_eq!(config(&json).unwrap(), written, "{json}");
        }
        let json = serde_json::to_string(&config(OLD).unwrap()).unwrap();
        assert!(
            json.contains(r#""features":["normal_x","normal_y","normal_z","projected_radius","#),
            "{json}"
        );
        assert!(
            json.contains(r#""radius_scale":1.3483422"#) && json.contains(r#""output":"correction""#),
            "{json}"
        );
    }

    #[test]
    fn a_list_of_channels_brings_its_own_search() {
        let mut value = serde_json::to_value(ModelConfig::correcting()).unwrap();
        value.as_object_mut().unwrap().remove("search");
        let without: ModelConfig = serde_json::from_value(value).unwrap();
        assert!(without.checked().unwrap_err().to_string().contains("search"));
        assert!(config(&OLD.replace("normal_radius_horizon", "smell")).is_err());
        assert!(config(&OLD.replace("\"patch\"", "\"smell\": 1, \"patch\"")).is_err());
    }
}
