//! A queue of runs: every configuration of a folder, with every seed.

use super::{
    Frames, TrainConfig, TrainEvent, TrainRun, ValidationScores, check_dir, checkpoint, log, train_on,
};
use aonet_scene::error::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A run in the queue.
#[derive(Debug, Clone, PartialEq)]
pub struct QueuedRun {
    /// Name of its folder: the configuration file's, with the seed if it is not the file's own.
    pub name: String,
    /// Its configuration.
    pub config: TrainConfig,
    /// Its folder.
    pub dir: PathBuf,
}

/// The configurations of a folder to train, and their seeds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// Seeds, in this order; each configuration's own if empty.
    pub seeds: Vec<u64>,
    /// File names without `.json`; all if empty.
    pub only: Vec<String>,
}

/// How a run of the queue ended.
#[derive(Debug)]
pub enum QueueEnd {
    /// It was finished before.
    Skipped,
    /// It was trained up to this step: its last one, or the step at the time limit.
    Trained(u64),
    /// The time limit came before it started.
    NotStarted,
    /// It failed.
    Failed(Error),
}

/// Events of a queue.
#[derive(Debug)]
pub enum QueueEvent<'a> {
    /// A run starts, or continues from this step.
    Started(u64),
    /// An event of the run.
    Of(TrainEvent),
    /// A run ended.
    Ended(&'a QueueEnd),
}

/// Summary of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// Name of the run.
    pub name: String,
    /// Steps saved in its checkpoint.
    pub steps: u64,
    /// Steps of its configuration.
    pub of_steps: u64,
    /// Step of the validation with the lowest loss.
    pub best_step: Option<u64>,
    /// Scores of that validation.
    pub best: Option<ValidationScores>,
}

impl QueuedRun {
    /// The summary of the run in its folder.
    ///
    /// # Errors
    /// When its checkpoint is broken or its log cannot be read.
    pub fn summary(&self) -> Result<RunSummary> {
        let (best_step, best) = log::best_validation(&self.dir)?.unzip();
        let steps = checkpoint::steps_taken(&self.dir)?;
        Ok(RunSummary { name: self.name.clone(), steps, of_steps: self.config.steps, best_step, best })
    }
}

/// The runs of every `*.json` in `configs`, by name; all with the first seed, then all with the next. Nothing is
/// written, so errors are found before any training.
///
/// # Errors
/// When a configuration is broken, none is left, or a folder in `runs` belongs to another one or holds a broken run.
pub fn plan(configs: &Path, runs: &Path, selection: &Selection) -> Result<Vec<QueuedRun>> {
    let configs = load_configs(configs, &selection.only)?;
    let seeds: Vec<_> = match selection.seeds.as_slice() {
        [] => vec![None],
        seeds => seeds.iter().copied().map(Some).collect(),
    };
    let mut queue: Vec<QueuedRun> = Vec::new();
    for seed in seeds {
        for (name, config) in &configs {
            let seed = seed.unwrap_or(config.seed);
            let name = if seed == config.seed { name.clone() } else { format!("{name}-{seed}") };
            if queue.iter().any(|run| run.name == name) {
                return Err(Error::request("queue", "one run for a name", format!("two named {name}")));
            }
            let run =
                QueuedRun { config: TrainConfig { seed, ..config.clone() }, dir: runs.join(&name), name };
            check_dir(&run.dir, &run.config)?;
            run.summary()?;
            queue.push(run);
        }
    }
    Ok(queue)
}

fn load_configs(dir: &Path, only: &[String]) -> Result<Vec<(String, TrainConfig)>> {
    let entries = std::fs::read_dir(dir).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let mut paths: Vec<_> = entries.map_err(Error::io(dir))?.into_iter().map(|e| e.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
    let name = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut named: Vec<_> = paths.into_iter().map(|path| (name(&path), path)).collect();
    named.sort();
    let known: Vec<_> = named.iter().map(|(name, _)| name.clone()).collect();
    if let Some(unknown) = only.iter().find(|name| !known.contains(name)) {
        return Err(Error::file(dir, format!("one of {}", known.join(", ")), unknown));
    }
    if named.is_empty() {
        return Err(Error::file(dir, "configurations (*.json)", "none"));
    }
    named.retain(|(name, _)| only.is_empty() || only.contains(name));
    named.into_iter().map(|(name, path)| Ok((name, TrainConfig::load(&path)?))).collect()
}

/// Trains the runs in order. A failed run does not stop the others. `run` has the options; its folder is
/// not used, and its time limit applies to the whole queue.
pub fn train_all(
    queue: &[QueuedRun],
    frames: &mut Frames,
    run: &TrainRun,
    events: &(dyn Fn(&QueuedRun, QueueEvent) + Sync),
) -> Vec<QueueEnd> {
    let started = Instant::now();
    let one = |queued: &QueuedRun| {
        let time_limit = run.time_limit.map(|limit| limit.saturating_sub(started.elapsed()));
        let run = TrainRun { dir: queued.dir.clone(), time_limit, ..run.clone() };
        let end = turn(queued, frames, &run, events).unwrap_or_else(QueueEnd::Failed);
        events(queued, QueueEvent::Ended(&end));
        end
    };
    queue.iter().map(one).collect()
}

fn turn(
    queued: &QueuedRun,
    frames: &mut Frames,
    run: &TrainRun,
    events: &(dyn Fn(&QueuedRun, QueueEvent) + Sync),
) -> Result<QueueEnd> {
    let steps = checkpoint::steps_taken(&queued.dir)?;
    if steps >= queued.config.steps {
        return Ok(QueueEnd::Skipped);
    }
    if run.time_limit == Some(Duration::ZERO) {
        return Ok(QueueEnd::NotStarted);
    }
    events(queued, QueueEvent::Started(steps));
    let steps = train_on(&queued.config, frames, run, &|event| events(queued, QueueEvent::Of(event)))?;
    Ok(QueueEnd::Trained(steps))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{tiny_config, tiny_dataset, tiny_run};
    use super::*;
    use crate::train::Augment;
    use aonet::net::{Features, ModelConfig, Output};
    use std::sync::Mutex;

    fn write(dir: &Path, name: &str, config: &TrainConfig) {
        std::fs::create_dir_all(dir).unwrap();
        std::fs::write(dir.join(name), serde_json::to_string(config).unwrap()).unwrap();
    }

    fn names(queue: &[QueuedRun]) -> Vec<(&str, u64)> {
        queue.iter().map(|run| (run.name.as_str(), run.config.seed)).collect()
    }

    fn all() -> Selection {
        Selection::default()
    }

    #[test]
    fn runs_are_sorted_by_name_within_each_seed() {
        let dir = tempfile::tempdir().unwrap();
        let (configs, runs) = (dir.path().join("configs"), dir.path().join("runs"));
        write(&configs, "b.json", &tiny_config(2));
        write(&configs, "a.json", &TrainConfig { seed: 2, ..tiny_config(2) });
        std::fs::write(configs.join("notes.txt"), "no configuration").unwrap();
        assert_eq!(names(&plan(&configs, &runs, &all()).unwrap()), [("a", 2), ("b", 1)]);
        let two = Selection { seeds: vec![1, 2], ..all() };
        let queue = plan(&configs, &runs, &two).unwrap();
        assert_eq!(names(&queue), [("a-1", 1), ("b", 1), ("a", 2), ("b-2", 2)]);
        assert_eq!(queue[3].dir, runs.join("b-2"));
        let b = Selection { only: vec!["b".into()], ..two };
        assert_eq!(names(&plan(&configs, &runs, &b).unwrap()), [("b", 1), ("b-2", 2)]);
        let unknown = Selection { only: vec!["c".into()], ..all() };
        assert!(plan(&configs, &runs, &unknown).unwrap_err().to_string().contains("expected one of a, b"));
        let twice = Selection { seeds: vec![3, 3], ..all() };
        assert!(plan(&configs, &runs, &twice).unwrap_err().to_string().contains("a-3"));
        assert!(!runs.exists(), "a plan writes nothing");
    }

    #[test]
    fn a_folder_of_another_configuration_is_named_before_anything_is_trained() {
        let dir = tempfile::tempdir().unwrap();
        let (configs, runs) = (dir.path().join("configs"), dir.path().join("runs"));
        write(&configs, "a.json", &tiny_config(2));
        write(&configs, "b.json", &tiny_config(2));
        write(&runs.join("b"), "config.json", &tiny_config(3));
        let error = plan(&configs, &runs, &all()).unwrap_err().to_string();
        assert!(error.contains(&runs.join("b/config.json").display().to_string()), "{error}");
        write(&runs.join("b"), "config.json", &tiny_config(2));
        assert_eq!(plan(&configs, &runs, &all()).unwrap().len(), 2);
    }

    /// Three runs, the second of which cannot train: crops larger than the frames.
    #[test]
    fn a_queue_survives_a_failing_run_and_goes_on_where_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let manifests = [tiny_dataset(&dir.path().join("frames"))];
        let (configs, runs) = (dir.path().join("configs"), dir.path().join("runs"));
        write(&configs, "a.json", &tiny_config(2));
        write(&configs, "b.json", &TrainConfig { crop: 96, ..tiny_config(2) });
        write(&configs, "c.json", &tiny_config(3));
        let queue = plan(&configs, &runs, &all()).unwrap();
        let run = tiny_run(Path::new("unused"));
        let quiet = |_: &QueuedRun, _: QueueEvent| ();
        let at_once = TrainRun { time_limit: Some(Duration::from_nanos(1)), ..run.clone() };
        let ends = train_all(&queue, &mut Frames::new(&manifests), &at_once, &quiet);
        assert!(ends.iter().all(|end| matches!(end, QueueEnd::NotStarted)), "{ends:?}");

        train_on(
            &queue[2].config,
            &mut Frames::new(&manifests),
            &TrainRun { dir: queue[2].dir.clone(), ..at_once },
            &|_| (),
        )
        .unwrap();
        let started = Mutex::new(Vec::new());
        let note = |queued: &QueuedRun, event: QueueEvent| {
            if let QueueEvent::Started(step) = event {
                started.lock().unwrap().push((queued.name.clone(), step));
            }
        };
        let ends = train_all(&queue, &mut Frames::new(&manifests), &run, &note);
        let [QueueEnd::Trained(2), QueueEnd::Failed(error), QueueEnd::Trained(3)] = &ends[..] else {
            panic!("{ends:?}")
        };
        assert!(error.to_string().contains("96x96"), "{error}");
        assert_eq!(*started.lock().unwrap(), [("a".into(), 0), ("b".into(), 0), ("c".into(), 1)]);
        let ends = train_all(&queue, &mut Frames::new(&manifests), &run, &quiet);
        assert!(matches!(&ends[..], [QueueEnd::Skipped, QueueEnd::Failed(_), QueueEnd::Skipped]), "{ends:?}");

        let summaries: Vec<_> = queue.iter().map(|run| run.summary().unwrap()).collect();
        assert_eq!(summaries.iter().map(|s| s.steps).collect::<Vec<_>>(), [2, 0, 3]);
        let best = summaries[2].best.unwrap();
        assert_eq!((summaries[2].best_step, summaries[1].best), (Some(3), None));
        assert!((best.loss - 0.5 * (1.0 - best.ssim)) > 0.0 && best.psnr > 5.0, "{best:?}");
    }

    #[test]
    fn frames_are_read_again_only_for_other_features_or_crops() {
        let dir = tempfile::tempdir().unwrap();
        let manifests = [tiny_dataset(&dir.path().join("frames"))];
        let mut frames = Frames::new(&manifests);
        let reads = |frames: &mut Frames, config: &TrainConfig| {
            let read = Mutex::new(0);
            let count = |event| *read.lock().unwrap() += u32::from(matches!(event, TrainEvent::Loaded(..)));
            frames.load(config, &count).unwrap();
            read.into_inner().unwrap() > 0
        };
        let config = tiny_config(2);
        assert!(reads(&mut frames, &config));
        assert!(!reads(&mut frames, &TrainConfig { steps: 9, seed: 4, ..config.clone() }));
        let less = Augment { without_second: 0.5, ..config.augment };
        let less = TrainConfig { augment: less, ..config.clone() };
        assert!(reads(&mut frames, &less) && !reads(&mut frames, &less));
        assert!(
            reads(&mut frames, &TrainConfig { seed: 4, ..less }),
            "the seed says which frames lose a layer"
        );
        let small = TrainConfig { crop: 32, ..config };
        assert!(reads(&mut frames, &small));
        let normals = ModelConfig {
            features: Features::normal(),
            search: None,
            survey: None,
            output: Output::Visibility,
            ..small.model.clone()
        };
        let normals = TrainConfig { model: normals, ..small };
        assert!(reads(&mut frames, &normals));
        assert!(reads(&mut frames, &TrainConfig { validation_frames: 1, ..normals.clone() }));
        assert!(reads(&mut frames, &normals), "only the last frames are kept");
    }
}
