//! What a common graphics processor is estimated to need for each method.

use anyhow::Result;
use aonet_lab::eval::Contestant;

/// What the axis of the chart says.
pub(super) const AXIS: &str = "estimated ms a frame of 1280x720, RTX 3060 class";

/// Estimated times (ms) of methods at 1280x720 with one layer, in f32, in their order; `None` where a method has no shaders.
///
/// # Errors
/// When the program was built without the feature `gpu`.
#[cfg(feature = "gpu")]
pub(super) fn gpu_ms(contestants: &[Contestant<'_>]) -> Result<Vec<Option<f64>>> {
    use crate::cmd::bench::gpu::estimate::RTX_3060;
    use aonet::Size;
    use aonet::gpu::Precision;
    use aonet_lab::eval::Method;
    use aonet_lab::timing::gpu::{classic_costs, network_costs};

    let size = Size::px(1280, 720);
    let of = |contestant: &Contestant<'_>| {
        let costs = match contestant.method {
            Method::Constant(_) => return Ok(None),
            Method::Network { model, .. } => network_costs(model, size, Precision::F32)?,
            Method::Classic { method, .. } => classic_costs(method, size),
        };
        Ok((!costs.is_empty()).then(|| costs.iter().map(|pass| RTX_3060.ms(pass)).sum()))
    };
    contestants.iter().map(of).collect()
}

/// The same.
///
/// # Errors
/// Always: the program was built without the feature `gpu`.
#[cfg(not(feature = "gpu"))]
pub(super) fn gpu_ms(_: &[Contestant<'_>]) -> Result<Vec<Option<f64>>> {
    anyhow::bail!("--plot-gpu: the estimates need a program built with --features gpu")
}
