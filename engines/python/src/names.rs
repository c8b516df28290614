//! What can be chosen by name.

use crate::errors;
use aonet::net::cpu::Precision;
use aonet::net::shipped;
use aonet::search::Classic;
use pyo3::prelude::*;

/// What follows a method's name and a colon.
const PRESETS: [&str; 6] = ["tuned", "deep", "low", "medium", "high", "ultra"];

/// The networks that come with the package.
#[pyfunction]
pub(crate) fn models() -> Vec<&'static str> {
    shipped::ALL.into_iter().map(|(name, _)| name).collect()
}

/// The classic methods, each followed by its presets.
#[pyfunction]
pub(crate) fn methods() -> Vec<String> {
    let mut names = Vec::new();
    for method in Classic::all() {
        names.push(method.name().to_owned());
        let presets = PRESETS.into_iter().map(|preset| format!("{}:{preset}", method.name()));
        names.extend(presets.filter(|name| Classic::named(name).is_ok()));
    }
    names
}

/// A parameter: name, value, least and largest value, whether it counts something, what it does.
type Parameter = (&'static str, f32, f32, f32, bool, &'static str);

/// The parameters of a classic method.
#[pyfunction]
pub(crate) fn parameters(method: &str) -> PyResult<Vec<Parameter>> {
    let method = Classic::named(method).map_err(errors::of_argument("method"))?;
    let one = |p: aonet::search::ParameterValue| (p.name, p.value, p.low, p.high, p.whole, p.doc);
    Ok(method.parameters().into_iter().map(one).collect())
}

/// The precisions that this machine has instructions for.
#[pyfunction]
pub(crate) fn precisions() -> Vec<String> {
    Precision::available().map(|precision| precision.to_string()).collect()
}
