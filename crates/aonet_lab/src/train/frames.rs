//! The frames of a run in memory, kept for the next run.

use super::config::{ExactSurvey, TrainConfig};
use super::samples::{self, Sample};
use super::validate::Validation;
use super::{TrainEvent, TrainEvents};
use crate::dataset::{Manifest, Split};
use aonet::net::{Features, SearchConfig};
use aonet::search::ArcsParams;
use aonet_scene::error::{Error, Result};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Datasets to train on. The last frames read stay in memory for the next run with the same choice.
pub struct Frames<'a> {
    manifests: &'a [Manifest],
    held: Option<(Wanted, Loaded)>,
}

/// Frames ready to draw crops from, and those to validate on.
pub(crate) struct Loaded {
    pub(crate) samples: Vec<Sample>,
    pub(crate) validation: Validation,
    /// Over all frames trained on.
    pub(crate) mean_visibility: f32,
}

/// The part of a configuration that determines which frames are read.
#[derive(PartialEq)]
struct Wanted {
    features: Features,
    search: Option<SearchConfig>,
    /// With the side of its patches (px).
    survey: Option<(ArcsParams, usize)>,
    crop: usize,
    validation_frames: usize,
    /// Shares of the frames that lose their guard band and their second layer, and the seed that says which ones.
    less: Option<([f64; 2], u64)>,
    exact_survey: Option<ExactSurvey>,
}

impl<'a> Frames<'a> {
    /// Creates the datasets; a run reads the frames.
    pub fn new(manifests: &'a [Manifest]) -> Self {
        Self { manifests, held: None }
    }

    /// The frames for `config`, from memory if they are the last ones.
    ///
    /// # Errors
    /// When a frame is broken or smaller than the crop, or a split has none.
    pub(crate) fn load(&mut self, config: &TrainConfig, events: TrainEvents) -> Result<&Loaded> {
        let less = [config.augment.without_margin, config.augment.without_second];
        let wanted = Wanted {
            features: samples::sampled(config.model.features.clone(), config.model.search),
            search: config.model.search,
            survey: config.model.survey.map(|arcs| (arcs, config.model.patch)),
            crop: config.crop,
            validation_frames: config.validation_frames,
            less: (less != [0.0; 2]).then_some((less, config.seed)),
            exact_survey: config.exact_survey.clone(),
        };
        let held = match self.held.take() {
            Some((found, loaded)) if found == wanted => loaded,
            other => {
                // Two sets of frames may not fit in memory.
                drop(other);
                read(self.manifests, config, events)?
            }
        };
        Ok(&self.held.insert((wanted, held)).1)
    }
}

fn read(manifests: &[Manifest], config: &TrainConfig, events: TrainEvents) -> Result<Loaded> {
    let of = |manifest| Manifest::frames(manifest, Split::Train).map(move |entry| (manifest, entry));
    let entries: Vec<_> = manifests.iter().flat_map(of).collect();
    if entries.is_empty() {
        return Err(Error::request("datasets", "frames of the split `train`", "none"));
    }
    let done = AtomicUsize::new(0);
    let samples = samples::load_all(&entries, config, &|| {
        let n = done.fetch_add(1, Ordering::Relaxed) + 1;
        events(TrainEvent::Loaded(n, entries.len()));
    })?;
    let mean = samples.iter().map(Sample::mean).sum::<f64>() / samples.len() as f64;
    let validation = Validation::load(manifests, config)?;
    Ok(Loaded { samples, validation, mean_visibility: mean as f32 })
}
