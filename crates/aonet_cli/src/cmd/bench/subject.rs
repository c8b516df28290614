//! Which methods are timed.

use super::Args;
use crate::setup;
use anyhow::{Context, Result};
use aonet::classic::Classic;
use aonet::net::{Model, shipped};
use std::path::{Path, PathBuf};

/// Networks of tables, for those who run the program in the project's folder.
const ROWS: &str = "assets/weights/rows";

/// A method and what a table calls it.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) name: String,
    pub(super) method: Method,
}

#[derive(Debug)]
pub(super) enum Method {
    Network(Box<Model>),
    Classic(Classic),
}

/// The methods that the arguments ask for.
pub(super) fn collect(args: &Args) -> Result<Vec<Subject>> {
    let all = args.methods.is_some();
    let mut subjects = if all { networks()? } else { Vec::new() };
    for path in &args.model {
        subjects.push(Subject::network(setup::name_of(path), setup::model(Some(path))?));
    }
    for path in &args.config {
        subjects.push(Subject::network(setup::name_of(path), setup::untrained(path)?));
    }
    let classic = if all && !args.ops { vec!["all".to_owned()] } else { args.classic.clone() };
    for (name, method) in setup::classic(&classic)? {
        subjects.push(Subject { name, method: Method::Classic(method) });
    }
    if subjects.is_empty() {
        subjects.push(Subject::network("any_radius".to_owned(), setup::model(None)?));
    }
    Ok(subjects)
}

/// The networks that come with the project, one of each configuration: weights do not change a time.
fn networks() -> Result<Vec<Subject>> {
    let mut subjects: Vec<Subject> = Vec::new();
    for (name, bytes) in [("any_radius", shipped::ANY_RADIUS), ("paper", shipped::PAPER)] {
        let model = Model::from_bytes(bytes).context("a shipped network")?;
        subjects.push(Subject::network(name.to_owned(), model));
    }
    for path in rows()? {
        let (name, model) = (setup::name_of(&path), setup::model(Some(&path))?);
        let known = |s: &Subject| matches!(&s.method, Method::Network(m) if m.config() == model.config());
        if !subjects.iter().any(known) {
            subjects.push(Subject::network(name, model));
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

impl Subject {
    fn network(name: String, model: Model) -> Self {
        Self { name, method: Method::Network(Box::new(model)) }
    }
}
