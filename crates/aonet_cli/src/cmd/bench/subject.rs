//! Which methods are timed.

use super::Args;
use crate::device::Device;
use crate::setup;
use anyhow::{Context, Result};
use aonet::Size;
use aonet::net::{Model, ModelConfig};
use aonet::search::Classic;
use aonet_lab::timing;
use std::path::{Path, PathBuf};

/// Networks in the project's folder, which are timed if the program runs there.
const PAPER: &str = "crates/aonet/models/paper.safetensors";
const ROWS: &str = "assets/models/rows";

/// A method that is not loaded yet, and its name in a table. It is loaded for its row only, so that a row's memory is its own.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) name: String,
    source: Source,
}

#[derive(Debug)]
enum Source {
    /// The network inside the program. Only one place may use its bytes, because every place would get a copy.
    Shipped,
    File(PathBuf),
    Config(PathBuf),
    Classic(Classic),
}

/// A method at one image size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Case<'a> {
    /// Name of the method in tables.
    pub(super) name: &'a str,
    pub(super) method: &'a Method,
    pub(super) size: Size,
}

/// A method that can run.
#[derive(Debug)]
pub(super) enum Method {
    Network(Box<Model>),
    Classic(Classic),
}

impl Method {
    /// Number of precisions that it can run in; 1 for classic methods.
    pub(super) fn precisions(&self) -> usize {
        match self {
            Self::Network(_) => usize::MAX,
            Self::Classic(_) => 1,
        }
    }
}

impl Subject {
    /// The method, ready for the precisions of the arguments.
    pub(super) fn load(&self, args: &Args) -> Result<Method> {
        let mut model = match &self.source {
            Source::Shipped => setup::model(None)?,
            Source::File(path) => setup::model(Some(path))?,
            Source::Config(path) => setup::untrained(path)?,
            Source::Classic(method) => return Ok(Method::Classic(*method)),
        };
        for precision in if args.device == Device::Cpu { args.precisions()? } else { vec![] } {
            model = timing::calibrated(model, precision)?;
        }
        Ok(Method::Network(Box::new(model)))
    }
}

/// The methods that the arguments ask for.
pub(super) fn collect(args: &Args) -> Result<Vec<Subject>> {
    let all = args.methods.is_some();
    let mut subjects = if all { networks(args)? } else { Vec::new() };
    let named = |path: &PathBuf, source: fn(PathBuf) -> Source| Subject {
        name: setup::name_of(path),
        source: source(path.clone()),
    };
    subjects.extend(args.model.iter().map(|path| named(path, Source::File)));
    subjects.extend(args.config.iter().map(|path| named(path, Source::Config)));
    let classic = if all && !args.ops { vec!["all".to_owned()] } else { args.classic.clone() };
    for (name, method) in setup::classic(&classic)? {
        subjects.push(Subject { name, source: Source::Classic(method) });
    }
    if subjects.is_empty() {
        subjects.push(Subject { name: "balanced".to_owned(), source: Source::Shipped });
    }
    Ok(subjects)
}

/// The networks of the project, one of each configuration, because weights do not change a time.
fn networks(args: &Args) -> Result<Vec<Subject>> {
    let own = Subject { name: "balanced".to_owned(), source: Source::Shipped };
    let paper = Some(PathBuf::from(PAPER)).filter(|path| path.is_file());
    let files = paper.into_iter().chain(rows()?);
    let files = files.map(|path| Subject { name: setup::name_of(&path), source: Source::File(path) });
    let mut known: Vec<ModelConfig> = Vec::new();
    let mut subjects = Vec::new();
    for subject in [own].into_iter().chain(files) {
        let Method::Network(model) = subject.load(args)? else { continue };
        if !known.contains(model.config()) {
            known.push(model.config().clone());
            subjects.push(subject);
        }
    }
    Ok(subjects)
}

/// Weights files of [`ROWS`], by name; none where the folder is not there.
fn rows() -> Result<Vec<PathBuf>> {
    if !Path::new(ROWS).is_dir() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(ROWS).context(ROWS)?;
    let mut paths = entries.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>().context(ROWS)?;
    paths.retain(|p| p.extension().is_some_and(|e| e == "safetensors"));
    // By name, not by path: `a` before `a-2`, though `-` comes before the dot of `a.safetensors`.
    paths.sort_by_key(|path| setup::name_of(path));
    Ok(paths)
}
