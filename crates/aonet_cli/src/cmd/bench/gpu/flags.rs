//! Flags that concern a graphics processor.

use aonet::gpu::{Device, Kernels};

/// Flags of `aonet bench` for graphics processors.
#[derive(Debug, clap::Args)]
pub(crate) struct Flags {
    /// --device gpu: the device's peak rate, for the lower bounds (TFLOP/s).
    #[arg(long, value_name = "TFLOP/S")]
    pub(super) peak_tflops: Option<f64>,
    /// --device gpu: the peak rate of its memory, for the lower bounds (GB/s).
    #[arg(long, value_name = "GB/S")]
    pub(super) bandwidth: Option<f64>,
    /// --device gpu: how networks are computed; may be repeated [default: plain, and those of the others
    /// that the device has].
    #[arg(long, value_enum)]
    pub(super) kernels: Vec<KernelsFlag>,
    /// --device gpu: also time a driver that computes on the CPU.
    #[arg(long)]
    pub(super) software: bool,
}

/// See [`Kernels`].
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub(super) enum KernelsFlag {
    /// With instructions that every device has.
    Plain,
    /// Filters are read once per subgroup.
    Subgroups,
    /// As products of cooperative matrices, in f16.
    Matrices,
}

impl KernelsFlag {
    /// The kernels to use on a device: plain if it has no such matrices.
    pub(super) fn on(self, device: &Device) -> Kernels {
        match self {
            Self::Plain => Kernels::Plain,
            Self::Subgroups => Kernels::Subgroups,
            Self::Matrices => device.matrices.map_or(Kernels::Plain, Kernels::Matrices),
        }
    }
}
