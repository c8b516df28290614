//! `aonet bench`: run-time of networks and of classic methods on this machine.

mod bent;
#[cfg(feature = "gpu")]
pub(super) mod gpu;
mod ops;
mod subject;
mod table;

use crate::device::{Device, LevelArg, PrecisionArg};
use crate::{output, setup};
use anyhow::Result;
use aonet::Size;
use aonet::net::cpu::{self, Options};
use aonet::simd::Level;
use aonet_lab::timing;
use clap::Parser;
use std::path::PathBuf;

/// Sizes of the paper's Table 2, and of common screens.
const SIZES: [Size; 5] = [
    Size::px(540, 540),
    Size::px(1280, 720),
    Size::px(2048, 1024),
    Size::px(1920, 1080),
    Size::px(3840, 2160),
];

/// Time methods: features, network and clamping of a frame whose buffers are in memory, or whose textures are on the device.
///
/// `first` is the time until the first image, once a model is in memory: the session is made and run once. `GFLOP`
/// counts multiplications and additions of direct convolutions, at the size that the network pads to. `peak` is the largest
/// memory of the process while the row was measured, frame and parameters included. --ops lists every step of the networks
/// instead, beside the time of its multiplications and of its memory traffic at the peak rates of this machine, which are
/// measured as well.
///
/// --device gpu times the shipped networks and the classic methods, unless others are named, with the device's own clock, and
/// prints an estimate for a common device.
#[derive(Debug, Parser)]
#[command(after_help = format!("{EXAMPLES}{GPU_EXAMPLE}"))]
pub(crate) struct Args {
    /// Network: fast, balanced, high, paper, or a file; may be repeated [default: balanced].
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// Configuration of a model or of a training run: a network with random weights; may be repeated.
    #[arg(long, value_name = "C.json")]
    config: Vec<PathBuf>,
    /// Classic method, `all` or `all:tuned`; may be repeated.
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// `all`: every classic method, and every network of the project with a configuration of its own.
    #[arg(long, value_parser = ["all"])]
    methods: Option<String>,
    /// Image size; may be repeated [default: 1280x720, 1920x1080, 3840x2160; on the CPU the paper's 540x540 and 2048x1024 as
    /// well].
    #[arg(long, value_name = "WxH", value_parser = setup::parse_size)]
    size: Vec<Size>,
    /// Threads; may be repeated [default: 1 and all cores].
    #[arg(long)]
    threads: Vec<usize>,
    /// Precision of the networks; may be repeated. A network without int8 ranges is calibrated on the timed frame, for
    /// times only [default: f32; on a GPU f32 and f16].
    #[arg(long, value_enum)]
    precision: Vec<PrecisionArg>,
    /// Vector instructions of the CPU [default: the best that it has].
    #[arg(long, value_enum, value_name = "LEVEL")]
    level: Option<LevelArg>,
    /// Counted runs, after the first [default: 15; on a GPU 50].
    #[arg(long)]
    runs: Option<usize>,
    /// Time what bent normals add, on the CPU: runs with and without them take turns.
    #[arg(long, conflicts_with = "ops")]
    bent_normals: bool,
    /// List every step beside its lower bound.
    #[arg(long, conflicts_with = "classic")]
    ops: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t)]
    device: Device,
    #[cfg(feature = "gpu")]
    #[command(flatten)]
    gpu: gpu::Flags,
}

const EXAMPLES: &str = "Examples:
  aonet bench --threads 1 --threads 2 --size 1920x1080
  aonet bench --methods all
  aonet bench --config configs/models/speed.json --ops --size 1280x720
  aonet bench --classic all --size 1280x720
  aonet bench --model fast --level avx2 --size 1280x720
  aonet bench --classic agtao:tuned --model balanced --bent-normals --size 640x360";

/// Its options are those of programs built with the feature `gpu`.
const GPU_EXAMPLE: &str = if cfg!(feature = "gpu") {
    "\n  aonet bench --device gpu --peak-tflops 12.7 --bandwidth 360"
} else {
    ""
};

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    anyhow::ensure!(
        !args.bent_normals || args.device == Device::Cpu,
        "--bent-normals: expected --device cpu; found gpu"
    );
    anyhow::ensure!(
        args.level.is_none() || args.device == Device::Cpu,
        "--level: expected --device cpu; found gpu"
    );
    match (args.device, args.ops) {
        #[cfg(feature = "gpu")]
        (Device::Gpu, _) => gpu::run(args),
        #[cfg(not(feature = "gpu"))]
        (Device::Gpu, _) => crate::device::absent(),
        (Device::Cpu, true) => ops::run(args, &subject::collect(args)?),
        (Device::Cpu, false) if args.bent_normals => bent::run(args, &subject::collect(args)?),
        (Device::Cpu, false) => table::run(args, &subject::collect(args)?),
    }
}

impl Args {
    fn sizes(&self) -> Vec<Size> {
        if self.size.is_empty() { SIZES.to_vec() } else { self.size.clone() }
    }

    fn threads(&self) -> Vec<usize> {
        let mut threads = self.threads.clone();
        if threads.is_empty() {
            threads = vec![1, setup::threads(None)];
        }
        threads.iter_mut().for_each(|count| *count = setup::threads(Some(*count)));
        threads.dedup();
        threads
    }

    /// The precisions on the CPU.
    fn precisions(&self) -> Result<Vec<cpu::Precision>> {
        match self.precision.is_empty() {
            true => Ok(vec![cpu::Precision::F32]),
            false => self.precision.iter().map(|precision| precision.cpu()).collect(),
        }
    }

    /// On the CPU.
    fn runs(&self) -> usize {
        self.runs.unwrap_or(15).max(1)
    }

    /// Vector instructions of the CPU.
    fn level(&self) -> Level {
        self.level.map_or_else(Level::best, Level::from)
    }

    /// A precision with every number of threads.
    fn options_of(&self, precision: cpu::Precision) -> impl Iterator<Item = Options> {
        let level = self.level();
        self.threads().into_iter().map(move |threads| Options { threads, level, precision })
    }

    /// Every precision with every number of threads.
    fn options(&self) -> Result<Vec<Options>> {
        Ok(self.precisions()?.into_iter().flat_map(|precision| self.options_of(precision)).collect())
    }

    /// The machine that the times belong to, and the instructions that they were measured with.
    fn machine(&self) -> String {
        format!("{}, {:?}", timing::device(), self.level())
    }
}

/// Reports on stderr what is measured now: a table of all methods takes minutes.
fn progress(name: &str, size: Size, options: Options) {
    output::note(&format!("{name} {size}, {}, threads: {}", options.precision, options.threads));
}
