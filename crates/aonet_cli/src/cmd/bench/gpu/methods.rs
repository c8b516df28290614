//! What is timed.

use super::flags::KernelsFlag;
use crate::cmd::bench::Args;
use crate::cmd::bench::subject::{self, Method};
use crate::output;
use anyhow::{Context, Result};
use aonet::gpu::{Device, Kernels, Precision};
use aonet::net::{Model, shipped};
use aonet::search::Classic;

/// The methods that the arguments name; without any, the shipped networks and the classic methods that have shaders (all but NNAO).
pub(super) fn methods(args: &Args) -> Result<Vec<(String, Method)>> {
    let none = args.model.is_empty() && args.config.is_empty() && args.classic.is_empty();
    if !none || args.methods.is_some() {
        let load = |s: subject::Subject| Ok((s.name.clone(), s.load(args)?));
        let mut methods = subject::collect(args)?.into_iter().map(load).collect::<Result<Vec<_>>>()?;
        methods.retain(|(name, method)| {
            let has_shaders = !matches!(method, Method::Classic(Classic::Nnao(_)));
            if !has_shaders {
                output::note(&format!("{name} has no shaders: left out"));
            }
            has_shaders
        });
        return Ok(methods);
    }
    let network = |(name, bytes): (&str, &[u8])| {
        let model = Model::from_bytes(bytes).context("a shipped network")?;
        anyhow::Ok((name.to_owned(), Method::Network(Box::new(model))))
    };
    let mut methods = shipped::ALL.into_iter().map(network).collect::<Result<Vec<_>>>()?;
    let classic = Classic::all().into_iter().filter(|m| !matches!(m, Classic::Nnao(_)));
    methods.extend(classic.map(|m| (m.name().to_owned(), Method::Classic(m))));
    Ok(methods)
}

/// A way to run a method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    pub(super) precision: Precision,
    pub(super) kernels: Kernels,
}

/// The ways to time a method: those of the arguments that the device has.
pub(super) fn ways(args: &Args, device: &Device, method: &Method) -> Result<Vec<Way>> {
    let plain = Way { precision: Precision::F32, kernels: Kernels::Plain };
    let Method::Network(model) = method else { return Ok(vec![plain]) };
    let mut precisions = args.precision.iter().map(|p| p.gpu()).collect::<Result<Vec<_>>>()?;
    if precisions.is_empty() {
        precisions = vec![Precision::F32, Precision::F16];
    }
    let all = [KernelsFlag::Plain, KernelsFlag::Subgroups, KernelsFlag::Matrices];
    let flags = if args.gpu.kernels.is_empty() { &all[..] } else { &args.gpu.kernels[..] };
    let mut ways = Vec::new();
    for precision in precisions {
        for flag in flags {
            let precision = precision.on(&device.device, &model.config().features);
            let way = Way { precision, kernels: flag.on(device).on(&device.device, precision) };
            if !ways.contains(&way) {
                ways.push(way);
            }
        }
    }
    Ok(ways)
}
