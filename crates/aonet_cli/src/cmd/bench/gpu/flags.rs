//! What the command line says of a graphics processor.

use aonet::gpu::{Device, Kernels};

/// What `aonet bench` is told of a graphics processor.
#[derive(Debug, clap::Args)]
pub(crate) struct Flags {
    /// --device gpu: what the device computes at best, for the floors (TFLOP/s).
    #[arg(long, value_name = "TFLOP/S")]
    pub(super) peak_tflops: Option<f64>,
    /// --device gpu: what its memory gives at best, for the floors (GB/s).
    #[arg(long, value_name = "GB/S")]
    pub(super) bandwidth: Option<f64>,
    /// --device gpu: how networks are computed; may be repeated [default: plain, and those of the others
    /// that the device has].
    #[arg(long, value_enum)]
    pub(super) kernels: Vec<KernelsFlag>,
    /// --device gpu: time a driver that computes on the CPU all the same.
    #[arg(long)]
    pub(super) software: bool,
}

/// See [`Kernels`].
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub(super) enum KernelsFlag {
    /// With what every device has.
    Plain,
    /// Filters are read once a subgroup.
    Subgroups,
    /// As products of cooperative matrices, in f16.
    Matrices,
}

impl KernelsFlag {
    /// What that is on a device: plain where it has no such matrices.
    pub(super) fn on(self, device: &Device) -> Kernels {
        match self {
            Self::Plain => Kernels::Plain,
            Self::Subgroups => Kernels::Subgroups,
            Self::Matrices => device.matrices.map_or(Kernels::Plain, Kernels::Matrices),
        }
    }
}
