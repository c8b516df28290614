//! `--device`: where a command computes.

use anyhow::Result;
use aonet_offline::backend::Backend;
use clap::ValueEnum;

/// What computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum DeviceName {
    /// The cores of this machine.
    #[default]
    Cpu,
    /// Its fastest graphics processor.
    Gpu,
}

impl DeviceName {
    /// What traces references.
    pub(crate) fn backend(self) -> Result<Backend> {
        match self {
            Self::Cpu => Ok(Backend::Cpu),
            Self::Gpu => gpu(),
        }
    }
}

#[cfg(feature = "gpu")]
fn gpu() -> Result<Backend> {
    use anyhow::Context;
    let device = aonet::net::gpu::Device::wait_for().context("--device gpu")?;
    log::debug!("{}: {}", device.adapter.name, device.adapter.driver_info);
    Ok(Backend::Gpu(Box::new(device)))
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Backend> {
    anyhow::bail!("--device gpu: this program was built without the feature gpu (cargo build --features gpu)")
}
