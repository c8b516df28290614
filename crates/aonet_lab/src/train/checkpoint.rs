//! A training run on disk: exact state to resume from, and models to use.

use super::optimizer::{Gradients, Moments};
use aonet::internals::graph::Graph;
use aonet::internals::weights::{Tensor, Weights};
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The state that the next step depends on, besides configuration and data.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) weights: Weights,
    /// Running mean of the weights; equal to them where none is asked for.
    pub(crate) average: Weights,
    pub(crate) moments: Moments,
    /// Lowest validation loss so far.
    pub(crate) best: f64,
}

impl State {
    /// The state before the first step.
    pub(crate) fn new(weights: Weights) -> Self {
        Self { moments: Moments::new(&weights), average: weights.clone(), weights, best: f64::INFINITY }
    }

    /// Takes new weights; `past` is the share of the past in their mean. Young means forget faster: at step n at most
    /// n / (n + 9), so that the first weights do not linger.
    pub(crate) fn take(&mut self, weights: Weights, past: f64) {
        let step = self.moments.step as f64;
        self.average.move_to(&weights, past.min(step / (step + 9.0)));
        self.weights = weights;
    }

    /// Writes the state; the file is replaced in one step.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn save(&self, path: &Path) -> Result<()> {
        let mut entries = Vec::new();
        for (name, tensor) in self.weights.tensors() {
            let moments = [
                ("mean", &self.moments.mean[name]),
                ("square", &self.moments.square[name]),
                ("weight", &tensor.values),
                ("average", &self.average.get(name).values),
            ];
            for (kind, values) in moments {
                let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
                entries.push((format!("{kind}/{name}"), tensor.shape.clone(), bytes));
            }
        }
        let wrong = |e| Error::file(path, "tensors that fit in a file", e);
        let views = entries
            .iter()
            .map(|(name, shape, bytes)| Ok((name, TensorView::new(Dtype::F32, shape.clone(), bytes)?)));
        let views: Vec<_> = views.collect::<std::result::Result<_, _>>().map_err(wrong)?;
        let facts = [("step", self.moments.step.to_string()), ("best", self.best.to_string())];
        let facts: HashMap<_, _> = facts.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
        atomic_file::write(path, &safetensors::serialize(views, Some(facts)).map_err(wrong)?)
    }

    /// Reads a state that [`State::save`] wrote for the same graph.
    ///
    /// # Errors
    /// When the file is broken or belongs to another network.
    pub(crate) fn load(path: &Path, graph: &Graph) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let wrong = |e: safetensors::SafeTensorError| Error::file(path, "a training checkpoint", e);
        let file = SafeTensors::deserialize(&bytes).map_err(wrong)?;
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(wrong)?;
        let fact =
            |key: &str| header.metadata().as_ref().and_then(|m| m.get(key)).cloned().unwrap_or_default();
        let missing = |_| Error::file(path, "a training checkpoint with `step` and `best`", "none");
        let step = fact("step").parse().map_err(|e: std::num::ParseIntError| missing(e.to_string()))?;
        let best = fact("best").parse().map_err(|e: std::num::ParseFloatError| missing(e.to_string()))?;
        let mut groups: HashMap<&str, BTreeMap<String, Tensor>> = HashMap::new();
        for (name, view) in file.iter() {
            let (kind, name) = name.split_once('/').unwrap_or(("", name));
            let values =
                view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            groups
                .entry(kind)
                .or_default()
                .insert(name.to_owned(), Tensor { shape: view.shape().to_vec(), values });
        }
        let has_average = groups.contains_key("average");
        let mut fitting =
            |kind| Weights::new(graph, groups.remove(kind).unwrap_or_default()).map_err(Error::in_file(path));
        let values_of = |w: Weights| -> Gradients {
            w.tensors().iter().map(|(n, t)| (n.clone(), t.values.clone())).collect()
        };
        let (mean, square) = (values_of(fitting("mean")?), values_of(fitting("square")?));
        let weights = fitting("weight")?;
        // Older checkpoints have no mean.
        let average = if has_average { fitting("average")? } else { weights.clone() };
        Ok(Self { average, weights, moments: Moments { step, mean, square }, best })
    }
}

/// Steps that the run in `dir` has taken; 0 without a checkpoint.
///
/// # Errors
/// When the checkpoint is broken.
pub(crate) fn steps_taken(dir: &Path) -> Result<u64> {
    let path = dir.join(super::CHECKPOINT);
    if !path.exists() {
        return Ok(0);
    }
    let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
    let (_, header) =
        SafeTensors::read_metadata(&bytes).map_err(|e| Error::file(&path, "a training checkpoint", e))?;
    let step = header.metadata().as_ref().and_then(|facts| facts.get("step")?.parse().ok());
    step.ok_or_else(|| Error::file(&path, "a training checkpoint with `step`", "none"))
}

#[cfg(test)]
mod tests {
    use super::super::config::Optimizer;
    use super::*;
    use aonet::net::ModelConfig;

    #[test]
    fn states_round_trip_and_refuse_another_network() {
        let small = ModelConfig { encoder: vec![2, 3], decoder: vec![2], ..ModelConfig::paper() };
        let graph = Graph::new(&small).unwrap();
        let mut state = State::new(Weights::init(&graph, 5));
        let gradients = state.moments.mean.iter().map(|(n, v)| (n.clone(), vec![0.5; v.len()])).collect();
        let tensors = state.moments.update(&state.weights, &gradients, (Optimizer::Adam, 1e-3));
        state.take(Weights::new(&graph, tensors).unwrap(), 0.5);
        state = State { best: 0.123_456_789, ..state };
        assert_ne!(state.average, state.weights);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("c.safetensors");
        state.save(&path).unwrap();
        assert_eq!(State::load(&path, &graph).unwrap(), state);
        let other = Graph::new(&ModelConfig { encoder: vec![2, 4], ..small }).unwrap();
        assert!(State::load(&path, &other).unwrap_err().to_string().contains("c.safetensors"));
        std::fs::write(&path, &std::fs::read(&path).unwrap()[..100]).unwrap();
        assert!(State::load(&path, &graph).is_err());
    }
}
