//! Measurements for the tables: scores, run-times and sizes of the requested rows.

use super::Subject;
use super::rows::{self, AO_NET, Trained};
use crate::dataset::Split;
use crate::eval::{self, Contestant, Method, Row};
use crate::timing;
use aonet::Size;
use aonet::net::cpu::Options;
use aonet::net::{Model, WeightFormat};
use aonet::search::Classic;
use aonet_scene::error::Result;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What to measure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Needs {
    /// Rows to score on the test frames.
    pub scores: BTreeSet<String>,
    /// Rows to time, and at which sizes.
    pub times: BTreeSet<(String, Size)>,
    /// Whether to score the constant image.
    pub constant: bool,
}

/// Measurements of a row with a network or a classic method.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Measured {
    /// Means over the test frames, one per seed; empty if not requested.
    pub scores: Vec<Row>,
    /// Median run-time (ms) by `WIDTHxHEIGHT`, of the first seed, because all seeds take equally long.
    pub ms: BTreeMap<String, f64>,
    /// Shortest run-time (ms) by `WIDTHxHEIGHT`: the time that a busy machine disturbs least.
    pub min_ms: BTreeMap<String, f64>,
    /// Scalar parameters of a network.
    pub parameters: Option<usize>,
    /// Multiply-accumulates a pixel of a network.
    pub macs_per_pixel: Option<f64>,
    /// Size of the model as a file of half floats (bytes), if the weights fit them.
    pub f16_bytes: Option<usize>,
    /// Optimiser steps that the model records.
    pub steps: u64,
    /// Training crops that the model records.
    pub crops: Option<u64>,
    /// Whether it was trained with the test frames' choice of radius, or works with any.
    pub radius_fits: bool,
}

/// A mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OverSeeds {
    /// Mean.
    pub mean: f64,
    /// Half of the distance between the extremes; absent for a single seed.
    pub spread: Option<f64>,
}

impl Measured {
    /// A score's mean over the seeds; none if a seed lacks the score.
    pub fn score(&self, of: impl Fn(&Row) -> Option<f64>) -> Option<OverSeeds> {
        let values: Vec<f64> = self.scores.iter().map(of).collect::<Option<_>>()?;
        let (low, high) =
            values.iter().fold((f64::INFINITY, -f64::INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread = (values.len() > 1).then_some(0.5 * (high - low));
        (!values.is_empty()).then_some(OverSeeds { mean, spread })
    }

    /// SSIM over the full frame.
    pub fn ssim(&self) -> Option<OverSeeds> {
        self.score(|r| Some(r.ssim))
    }

    /// Mean PSNR over the full frame (dB).
    pub fn psnr(&self) -> Option<OverSeeds> {
        self.score(|r| Some(r.psnr))
    }

    /// Median run-time at a size (ms).
    pub fn ms_at(&self, size: Size) -> Option<f64> {
        self.ms.get(&size.to_string()).copied()
    }
}

/// All measurements.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Measurements {
    /// By row; rows that are not trained are absent.
    pub rows: BTreeMap<String, Measured>,
    /// The constant image's value and its scores.
    pub constant: Option<(f32, Row)>,
}

impl Measurements {
    /// A row's network, if it has one.
    pub fn row(&self, key: &str) -> Option<&Measured> {
        self.rows.get(key)
    }
}

/// Measures the requested rows that have networks. Scores need a dataset; without one there are none.
/// `progress` is called with the current work, the part done and the total.
///
/// # Errors
/// When a frame is broken, the dataset has no test frames, or a network cannot be run.
pub fn measure(
    needs: &Needs,
    subject: &Subject<'_>,
    progress: &dyn Fn(&str, usize, usize),
) -> Result<Measurements> {
    let mut found = Measurements::default();
    let all: BTreeSet<&str> =
        needs.times.iter().map(|(k, _)| &**k).chain(needs.scores.iter().map(|k| &**k)).collect();
    for key in all {
        if let Some(trained) = subject.models.seeds(key).first() {
            found.rows.insert(key.to_owned(), facts(trained, subject));
        } else if rows::classic(key).is_some() {
            found.rows.insert(key.to_owned(), Measured { radius_fits: true, ..Measured::default() });
        }
    }
    let options = Options { threads: subject.threads, ..Options::default() };
    for (done, (key, size)) in needs.times.iter().enumerate() {
        let times = match (subject.models.first(key), rows::classic(key)) {
            (Some(model), _) => Some(timing::time(model, *size, options, subject.runs)?),
            (None, Some(method)) => Some(timing::time_classic(&method, *size, options, subject.runs)?),
            (None, None) => None,
        };
        if let (Some(times), Some(row)) = (times, found.rows.get_mut(key)) {
            row.ms.insert(size.to_string(), times.median_ms);
            row.min_ms.insert(size.to_string(), times.min_ms);
        }
        progress("timing", done + 1, needs.times.len());
    }
    score((needs, subject), &mut found, progress)?;
    Ok(found)
}

fn facts(trained: &Trained, subject: &Subject<'_>) -> Measured {
    let model = &trained.model;
    Measured {
        parameters: Some(model.graph().params_count()),
        macs_per_pixel: Some(model.graph().macs_per_pixel()),
        f16_bytes: model.to_bytes(WeightFormat::F16).ok().map(|bytes| bytes.len()),
        steps: model.facts().steps,
        crops: Some(model.facts().crops).filter(|crops| *crops > 0),
        radius_fits: subject.manifest.is_none_or(|manifest| eval::radius_fits(model, manifest)),
        ..Measured::default()
    }
}

/// The method that is scored for a row.
enum Job<'a> {
    Network(&'a Model),
    Classic(Classic),
}

/// Runs networks one after the other, so that only one has its memory at a time.
fn score(
    (needs, subject): (&Needs, &Subject<'_>),
    found: &mut Measurements,
    progress: &dyn Fn(&str, usize, usize),
) -> Result<()> {
    let Some(manifest) = subject.manifest else { return Ok(()) };
    let frames = manifest.frames(Split::Test).count();
    let jobs_of = |key: &String| -> Vec<Job<'_>> {
        let networks: Vec<_> = subject.models.seeds(key).iter().map(|t| Job::Network(&t.model)).collect();
        if networks.is_empty() {
            rows::classic(key).map(Job::Classic).into_iter().collect()
        } else {
            networks
        }
    };
    let jobs: Vec<(&str, Job<'_>)> =
        needs.scores.iter().flat_map(|key| jobs_of(key).into_iter().map(|job| (&**key, job))).collect();
    let total = frames * (jobs.len() + usize::from(needs.constant));
    let run = |method, nth: usize| -> Result<Row> {
        let contestant = Contestant { name: String::new(), method };
        let progress = |done: usize, _: usize| progress("scoring", nth * frames + done, total);
        let table = eval::evaluate(manifest, Split::Test, &[contestant], &progress)?;
        Ok(table.overall[0].1)
    };
    for (nth, (key, job)) in jobs.iter().enumerate() {
        let method = match job {
            Job::Network(model) => Method::network(model, subject.threads),
            Job::Classic(method) => Method::Classic { method, threads: subject.threads },
        };
        let scores = run(method, nth)?;
        found.rows.entry((*key).to_owned()).or_default().scores.push(scores);
    }
    if needs.constant {
        let value = constant(subject)?;
        found.constant = value
            .map(|v| Ok::<_, aonet_scene::Error>((v, run(Method::Constant(v), jobs.len())?)))
            .transpose()?;
    }
    Ok(())
}

/// The mean visibility that the paper's network was trained on; else another network's, else that of the dataset's
/// training frames, else none.
fn constant(subject: &Subject<'_>) -> Result<Option<f32>> {
    let keys = [AO_NET, "ours"].into_iter().chain(rows::TABLE_4.iter().map(|r| r.key));
    let told =
        keys.chain(subject.models.keys()).find_map(|k| subject.models.first(k)?.facts().mean_visibility);
    match (told.filter(|v| (0.0..=1.0).contains(v)), subject.manifest) {
        (None, Some(manifest)) if manifest.frames(Split::Train).next().is_some() => {
            eval::mean_visibility(manifest).map(Some)
        }
        (told, _) => Ok(told),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::fixtures;

    #[test]
    fn seeds_are_averaged_with_their_spread() {
        let row = |ssim| Row { ssim, ..fixtures::scores(0.0, 20.0) };
        let measured = Measured { scores: vec![row(0.8), row(0.9), row(0.85)], ..Measured::default() };
        let over = measured.ssim().unwrap();
        assert!((over.mean - 0.85).abs() < 1e-12 && (over.spread.unwrap() - 0.05).abs() < 1e-12, "{over:?}");
        assert_eq!(Measured { scores: vec![row(0.8)], ..Measured::default() }.ssim().unwrap().spread, None);
        assert_eq!(Measured::default().ssim(), None);
        assert_eq!(measured.score(|r| r.ssim_foreground), None);
    }
}
