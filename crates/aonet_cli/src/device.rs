//! Where commands compute.

use anyhow::{Result, bail};
use aonet::net::cpu;
use aonet::simd::Level;
use aonet_scene::backend::Backend;
use clap::ValueEnum;

/// Where to compute.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Device {
    /// The processor, with all --threads.
    #[default]
    Cpu,
    /// The fastest graphics processor; needs a Vulkan, Metal or Direct3D 12 driver, and a program built with the feature
    /// `gpu`.
    Gpu,
}

impl Device {
    /// Its name in JSON output.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }

    /// The backend that traces references.
    ///
    /// # Errors
    /// When there is no such device.
    pub(crate) fn backend(self) -> Result<Backend> {
        match self {
            Self::Cpu => Ok(Backend::Cpu),
            #[cfg(feature = "gpu")]
            Self::Gpu => Ok(Backend::Gpu(Box::new(gpu()?))),
            #[cfg(not(feature = "gpu"))]
            Self::Gpu => absent(),
        }
    }
}

/// Precision of a network.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum PrecisionArg {
    /// 32-bit floats, on every device.
    F32,
    /// GPU: 16-bit floats, if it has them and the network reads no lengths in world units; otherwise f32, with a note on stderr.
    /// Long sums and the horizon search stay in 32 bits.
    F16,
    /// CPU: AVX-512 BF16.
    Bf16,
    /// CPU: AVX-512 VNNI, and a network from `aonet calibrate` or a shipped one.
    Int8,
}

impl PrecisionArg {
    /// The precision on the CPU.
    ///
    /// # Errors
    /// When the CPU does not have it.
    pub(crate) fn cpu(self) -> Result<cpu::Precision> {
        Ok(match self {
            Self::F32 => cpu::Precision::F32,
            Self::Bf16 => cpu::Precision::Bf16,
            Self::Int8 => cpu::Precision::Int8,
            Self::F16 => bail!("--precision f16 needs --device gpu; the CPU has f32, bf16 and int8"),
        })
    }

    /// The precision on graphics processors.
    ///
    /// # Errors
    /// When they do not have it.
    #[cfg(feature = "gpu")]
    pub(crate) fn gpu(self) -> Result<aonet::gpu::Precision> {
        Ok(match self {
            Self::F32 => aonet::gpu::Precision::F32,
            Self::F16 => aonet::gpu::Precision::F16,
            Self::Bf16 | Self::Int8 => {
                bail!("--precision bf16 and int8 need --device cpu; a GPU has f32 and f16")
            }
        })
    }
}

/// Vector instructions of a CPU.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum LevelArg {
    /// Every processor: SSE2 or NEON, 128 bits.
    Portable,
    /// x86-64: AVX2 and FMA, 256 bits.
    Avx2,
    /// x86-64: AVX-512F, 512 bits.
    Avx512,
}

impl From<LevelArg> for Level {
    fn from(level: LevelArg) -> Self {
        match level {
            LevelArg::Portable => Self::Portable,
            LevelArg::Avx2 => Self::Avx2,
            LevelArg::Avx512 => Self::Avx512,
        }
    }
}

/// The fastest graphics processor.
#[cfg(feature = "gpu")]
pub(crate) fn gpu() -> Result<aonet::gpu::Device> {
    use anyhow::Context;
    aonet::gpu::Device::wait_for().context(
        "--device gpu needs a Vulkan, Metal or Direct3D 12 driver, such as Debian's mesa-vulkan-drivers, which computes on \
         the CPU where there is no GPU; --device cpu needs none",
    )
}

/// Reports device and precision on stderr.
#[cfg(feature = "gpu")]
pub(crate) fn announce(device: &aonet::gpu::Device, precision: aonet::gpu::Precision) {
    crate::output::note(&format!("{}, {precision}", device.adapter.name));
}

/// # Errors
/// Always: this build has no runtime for graphics processors.
#[cfg(not(feature = "gpu"))]
pub(crate) fn absent<T>() -> Result<T> {
    bail!(
        "--device gpu: this program was built without the feature gpu; build it with `cargo build --release --features gpu`, \
         or use --device cpu"
    )
}
