//! A configuration, its graph and weights that fit: the only road to a session.

use crate::error::{Error, Result};
use crate::net::config::{ModelConfig, SearchConfig};
use crate::net::graph::Graph;
use crate::net::weights::{Tensor, Weights};
use crate::search::{AgtaoParams, ArcsParams};
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// Version of the metadata that is written. Version 1 had one name for all features and no parameters of a search.
const FORMAT: u32 = 2;
/// Versions that can be read.
const READABLE: std::ops::RangeInclusive<u64> = 1..=2;
/// Metadata key that holds our JSON.
const KEY: &str = "aonet";

/// How a model was trained. None of these fields is checked, and no result depends on them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct TrainingFacts {
    /// Name or preset of the dataset, with its size.
    pub dataset: String,
    /// How the AO radius of the training frames was chosen.
    pub radius: String,
    /// Mean visibility of the training frames: the constant image that every model must beat.
    pub mean_visibility: Option<f32>,
    /// The training command.
    pub command: String,
    /// The version of the code.
    pub commit: String,
    /// Optimiser steps.
    pub steps: u64,
    /// Crops trained on, all steps together.
    pub crops: u64,
    /// Frames trained on.
    pub train_frames: u64,
    /// Metrics on validation frames, by name.
    pub validation: BTreeMap<String, f64>,
}

/// A network that can run.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    config: ModelConfig,
    graph: Graph,
    weights: Weights,
    facts: TrainingFacts,
    ranges: Option<Ranges>,
}

/// Number format of a weights file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightFormat {
    /// 32-bit floats.
    F32,
    /// 16-bit floats: half the size.
    F16,
}

#[derive(Serialize, Deserialize)]
struct Metadata {
    format: u32,
    config: ModelConfig,
    #[serde(default)]
    facts: TrainingFacts,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ranges: Option<Ranges>,
}

/// Least and greatest value of every channel of what convolutions read, on frames of a data set: of each convolution by
/// its name, and of the partitioned `features`. What integers need to know.
pub type Ranges = BTreeMap<String, Vec<[f32; 2]>>;

impl Model {
    /// A model from its parts.
    ///
    /// # Errors
    /// When the configuration is out of range or the weights do not fit it.
    #[doc(hidden)]
    pub fn new(config: ModelConfig, weights: Weights, facts: TrainingFacts) -> Result<Self> {
        let graph = Graph::new(&config)?;
        let weights = Weights::new(&graph, weights.tensors().clone())?;
        Ok(Self { config, graph, weights, facts, ranges: None })
    }

    /// Reads a safetensors file that [`Model::to_bytes`] wrote, f32 or f16.
    ///
    /// # Errors
    /// When the bytes are no such file, or the tensors are not exactly those of the configuration.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let wrong = |found: String| Error::format("weights file", "safetensors with aonet metadata", found);
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| wrong(e.to_string()))?;
        let json = header
            .metadata()
            .as_ref()
            .and_then(|m| m.get(KEY))
            .ok_or_else(|| wrong("no aonet metadata".into()))?;
        let format =
            serde_json::from_str::<serde_json::Value>(json).ok().and_then(|v| v.get("format")?.as_u64());
        if !format.is_some_and(|format| READABLE.contains(&format)) {
            let expected = format!("format {} to {}", READABLE.start(), READABLE.end());
            return Err(Error::format("weights file", expected, format!("{format:?}")));
        }
        let metadata: Metadata = serde_json::from_str(json).map_err(|e| wrong(e.to_string()))?;
        let file = SafeTensors::deserialize(bytes).map_err(|e| wrong(e.to_string()))?;
        let mut tensors = BTreeMap::new();
        for (name, view) in file.iter() {
            tensors.insert(
                name.to_owned(),
                Tensor { shape: view.shape().to_vec(), values: values_of(name, &view)? },
            );
        }
        let graph = Graph::new(&metadata.config)?;
        let weights = Weights::new(&graph, tensors)?;
        let model = Self { config: metadata.config, graph, weights, facts: metadata.facts, ranges: None };
        match metadata.ranges {
            Some(ranges) => model.with_ranges(ranges),
            None => Ok(model),
        }
    }

    /// The model as a safetensors file. Equal models give equal bytes.
    ///
    /// # Errors
    /// When a weight does not fit the format.
    pub fn to_bytes(&self, numbers: WeightFormat) -> Result<Vec<u8>> {
        let metadata = Metadata {
            format: FORMAT,
            config: self.config.clone(),
            facts: self.facts.clone(),
            ranges: self.ranges.clone(),
        };
        let json = serde_json::to_string(&metadata).map_err(|e| Error::format("metadata", "JSON", e))?;
        let mut encoded = Vec::new();
        for (name, tensor) in self.weights.tensors() {
            let (dtype, bytes): (Dtype, Vec<u8>) = match numbers {
                WeightFormat::F32 => {
                    (Dtype::F32, tensor.values.iter().flat_map(|v| v.to_le_bytes()).collect())
                }
                WeightFormat::F16 => {
                    (Dtype::F16, tensor.values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect())
                }
            };
            if numbers == WeightFormat::F16 && tensor.values.iter().any(|v| f16::from_f32(*v).is_infinite()) {
                return Err(Error::weights(name, "values within half-float range", "a larger one"));
            }
            encoded.push((name, dtype, tensor.shape.clone(), bytes));
        }
        let views = encoded.iter().map(|(name, dtype, shape, bytes)| {
            TensorView::new(*dtype, shape.clone(), bytes).map(|view| (name.as_str(), view))
        });
        let wrong =
            |e: safetensors::SafeTensorError| Error::format("weights", "tensors that fit in a file", e);
        let views = views.collect::<std::result::Result<Vec<_>, _>>().map_err(wrong)?;
        safetensors::serialize(views, Some(HashMap::from([(KEY.to_owned(), json)]))).map_err(wrong)
    }

    /// The same with ranges for integers.
    ///
    /// # Errors
    /// When a value is not finite, or a least value is greater than the greatest.
    pub fn with_ranges(mut self, ranges: Ranges) -> Result<Self> {
        for (name, channels) in &ranges {
            if let Some(range) =
                channels.iter().find(|[least, most]| !(least <= most && (most - least).is_finite()))
            {
                let what = format!("ranges of {name}");
                return Err(Error::value(&what, "a least and a greatest finite value", format!("{range:?}")));
            }
        }
        self.ranges = Some(ranges);
        Ok(self)
    }

    /// The same network with a search of so many slices, with so many taps on each side of a slice. More slices have less noise, more
    /// taps find thinner occluders, and both cost time. The network was trained with its own numbers.
    ///
    /// # Errors
    /// When the network has no search, or a number is out of range (1 to 64).
    pub fn with_taps(mut self, slices: u32, taps: u32) -> Result<Self> {
        match &mut self.config.search {
            Some(SearchConfig::Agtao(search)) => *search = AgtaoParams { slices, steps: taps, ..*search },
            Some(SearchConfig::Arcs(search)) => *search = ArcsParams { slices, steps: taps, ..*search },
            None => return Err(Error::config("network", "one with a search", "one without")),
        }
        self.checked()
    }

    /// The same network with a survey of so many slices and taps: see [`Model::with_taps`].
    ///
    /// # Errors
    /// When the network has no survey, or a number is out of range (1 to 64).
    pub fn with_survey_taps(mut self, slices: u32, taps: u32) -> Result<Self> {
        let survey = self.config.survey.as_mut();
        let survey = survey.ok_or_else(|| Error::config("network", "one with a survey", "one without"))?;
        *survey = ArcsParams { slices, steps: taps, ..*survey };
        self.checked()
    }

    /// The network after a change of its configuration that its weights do not depend on.
    fn checked(mut self) -> Result<Self> {
        self.config = self.config.checked()?;
        self.graph = Graph::new(&self.config)?;
        Ok(self)
    }

    /// Ranges for integers, of a model that was calibrated.
    pub fn ranges(&self) -> Option<&Ranges> {
        self.ranges.as_ref()
    }

    /// What the network is.
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }

    /// Its operations.
    #[doc(hidden)]
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Its parameters.
    #[doc(hidden)]
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// How it came to be.
    pub fn facts(&self) -> &TrainingFacts {
        &self.facts
    }
}

fn values_of(name: &str, view: &TensorView<'_>) -> Result<Vec<f32>> {
    match view.dtype() {
        Dtype::F32 => {
            Ok(view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
        }
        Dtype::F16 => {
            Ok(view.data().chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect())
        }
        other => Err(Error::weights(name, "f32 or f16 values", format!("{other:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Model {
        let config = ModelConfig { encoder: vec![4, 6], decoder: vec![5], ..ModelConfig::correcting() };
        let weights = Weights::init(&Graph::new(&config).unwrap(), 7);
        let facts = TrainingFacts { steps: 3, mean_visibility: Some(0.75), ..TrainingFacts::default() };
        Model::new(config, weights, facts).unwrap()
    }

    #[test]
    fn files_round_trip() {
        let model = model();
        assert_eq!(Model::from_bytes(&model.to_bytes(WeightFormat::F32).unwrap()).unwrap(), model);
        let half = Model::from_bytes(&model.to_bytes(WeightFormat::F16).unwrap()).unwrap();
        assert_eq!(half.weights(), &model.weights().clone().rounded_to_half());
        assert_ne!(half.weights(), model.weights());
    }

    #[test]
    fn taps_are_those_of_the_search_or_the_survey() {
        let of = |config: ModelConfig| {
            let weights = Weights::init(&Graph::new(&config).unwrap(), 7);
            Model::new(config, weights, TrainingFacts::default()).unwrap()
        };
        let balanced = ModelConfig::balanced();
        let searching = of(balanced.clone()).with_taps(4, 8).unwrap();
        let Some(SearchConfig::Agtao(search)) = searching.config().search else { panic!("a horizon search") };
        assert_eq!((search.slices, search.steps), (4, 8));
        assert_eq!(searching.config().survey, balanced.survey);
        let surveying = of(balanced.clone()).with_survey_taps(5, 24).unwrap();
        let survey = surveying.config().survey.unwrap();
        assert_eq!((survey.slices, survey.steps), (5, 24));
        assert_eq!(surveying.config().search, balanced.search);
        let arcs = Some(SearchConfig::Arcs(ArcsParams::default()));
        let searching = of(ModelConfig { search: arcs, ..ModelConfig::correcting() });
        let arcs = SearchConfig::Arcs(ArcsParams { slices: 6, steps: 10, ..ArcsParams::default() });
        assert_eq!(searching.with_taps(6, 10).unwrap().config().search, Some(arcs));
        let paper = || of(ModelConfig::paper());
        assert!(paper().with_taps(4, 16).unwrap_err().to_string().contains("with a search"));
        assert!(model().with_survey_taps(4, 16).unwrap_err().to_string().contains("with a survey"));
        let error = of(balanced).with_taps(0, 16).unwrap_err().to_string();
        assert!(error.contains("slices") && error.contains('0'), "{error}");
    }

    #[test]
    fn equal_models_give_equal_bytes() {
        assert_eq!(
            model().to_bytes(WeightFormat::F16).unwrap(),
            model().to_bytes(WeightFormat::F16).unwrap()
        );
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = model().to_bytes(WeightFormat::F16).unwrap();
        for end in (0..bytes.len()).step_by(7) {
            assert!(Model::from_bytes(&bytes[..end]).is_err(), "{end} of {} bytes", bytes.len());
        }
    }

    /// The same file as version 1 of the metadata had it.
    fn in_version_1(bytes: &[u8]) -> Vec<u8> {
        let (_, header) = SafeTensors::read_metadata(bytes).unwrap();
        let mut json: serde_json::Value =
            serde_json::from_str(&header.metadata().as_ref().unwrap()[KEY]).unwrap();
        assert_eq!(json["format"], FORMAT);
        json["format"] = 1.into();
        let config = json["config"].as_object_mut().unwrap();
        config["features"] = "normal_radius_horizon".into();
        config["kernel"] = "correction".into();
        assert!(config.remove("output").is_some() && config.remove("search").is_some());
        let metadata = HashMap::from([(KEY.to_owned(), json.to_string())]);
        safetensors::serialize(SafeTensors::deserialize(bytes).unwrap().tensors(), Some(metadata)).unwrap()
    }

    #[test]
    fn files_of_version_1_load_as_the_same_model() {
        // Its search is the one of the old files.
        let bytes = crate::net::shipped::FAST;
        let old = Model::from_bytes(&in_version_1(bytes)).unwrap();
        assert_eq!(old, Model::from_bytes(bytes).unwrap());
        assert!(old.config().search.is_some());
    }

    #[test]
    fn tensors_must_fit_exactly() {
        let model = model();
        let graph = model.graph();
        let with = |change: &dyn Fn(&mut BTreeMap<String, Tensor>)| {
            let mut tensors = model.weights().tensors().clone();
            change(&mut tensors);
            Weights::new(graph, tensors).unwrap_err().to_string()
        };
        assert!(with(&|t| drop(t.remove("head.bias"))).contains("head.bias"));
        assert!(with(&|t| t.get_mut("head.bias").unwrap().values[0] = f32::NAN).contains("finite"));
        assert!(with(&|t| t.get_mut("enc0.conv0.weight").unwrap().shape.swap(0, 1)).contains("shape"));
        assert!(
            with(&|t| drop(t.insert("x".into(), Tensor { shape: vec![0], values: vec![] }))).contains("x")
        );
    }
}
