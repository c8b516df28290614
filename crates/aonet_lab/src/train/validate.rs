//! Scores on whole validation frames.

use super::config::TrainConfig;
use super::exact_survey;
use super::samples::seen_of;
use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval::read;
use aonet::internals::naive::Planes;
use aonet::internals::weights::Weights;
use aonet::net::cpu::Session;
use aonet::net::{Model, TrainingFacts};
use aonet::{AoImage, AoParams, GBuffer, metrics};
use aonet_scene::error::{Error, Result};
use rayon::prelude::*;
use serde::Serialize;

/// Means over the validation frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ValidationScores {
    /// 0.5 (1 - SSIM) + mean absolute error: what the best checkpoint minimises.
    pub loss: f64,
    /// Gaussian 11x11, full frame.
    pub ssim: f64,
    /// Mean of the frames' PSNR (dB), full frame.
    pub psnr: f64,
}

impl ValidationScores {
    pub(crate) fn named(&self) -> Vec<(&'static str, f64)> {
        vec![("loss", self.loss), ("ssim", self.ssim), ("psnr", self.psnr)]
    }
}

/// A frame, its reference, and the exact shares of light if they stand in for the network's survey.
type Frame = (GBuffer<'static>, AoParams, AoImage, Option<Planes>);

/// Validation frames in memory. The CPU runtime runs them, so scores are those of the shipped program.
pub(crate) struct Validation {
    frames: Vec<Frame>,
}

impl Validation {
    /// Reads frames of the split `val` (scenes that are not trained on), else of `val_seen`.
    ///
    /// # Errors
    /// When a frame is broken, or there is none.
    pub(crate) fn load(manifests: &[Manifest], config: &TrainConfig) -> Result<Self> {
        let of = |split: Split| -> Vec<_> {
            manifests.iter().flat_map(|m| m.frames(split).map(move |entry| (m, entry))).collect()
        };
        let mut entries = of(Split::Val);
        if entries.is_empty() {
            entries = of(Split::ValSeen);
        }
        if entries.is_empty() {
            return Err(Error::request("datasets", "frames of the split `val` or `val_seen`", "none"));
        }
        let count = config.validation_frames.clamp(1, entries.len());
        let chosen: Vec<_> = (0..count).map(|i| entries[i * entries.len() / count]).collect();
        let frame = |(manifest, entry): (&Manifest, &FrameEntry)| {
            let (gbuffer, params, reference) = read(manifest, entry)?;
            let exact = config
                .exact_survey
                .as_ref()
                .map(|exact| exact.read(entry, config.model.patch))
                .transpose()?;
            Ok((seen_of(gbuffer, config, entry), params, reference, exact))
        };
        let frames = chosen.into_par_iter().map(frame).collect::<Result<_>>()?;
        Ok(Self { frames })
    }

    /// Means over all frames.
    ///
    /// # Errors
    /// When a frame is too small to compare.
    pub(crate) fn score(&self, config: &TrainConfig, weights: &Weights) -> Result<ValidationScores> {
        let model = Model::new(config.model.clone(), weights.clone(), TrainingFacts::default())?;
        let score = |(gbuffer, params, reference, exact): &Frame| -> Result<[f64; 3]> {
            let ao = match exact {
                Some(survey) => exact_survey::run(&model, (gbuffer, *params), survey)?,
                None => {
                    let mut ao = AoImage::open(gbuffer.window().size());
                    Session::new(&model, gbuffer.window(), 1)?.run(gbuffer, *params, &mut ao)?;
                    ao
                }
            };
            let full = metrics::compare(reference, &ao, None)?.full;
            let pairs = ao.visibility().iter().zip(reference.visibility());
            let l1 = pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / ao.visibility().len() as f64;
            Ok([0.5 * (1.0 - full.ssim) + l1, full.ssim, full.psnr])
        };
        let all: Vec<[f64; 3]> = self.frames.par_iter().map(score).collect::<Result<_>>()?;
        let mean = |k: usize| all.iter().map(|s| s[k]).sum::<f64>() / all.len() as f64;
        Ok(ValidationScores { loss: mean(0), ssim: mean(1), psnr: mean(2) })
    }
}
