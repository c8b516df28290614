//! `aonet bench`: run-time of networks and of classic methods on this machine.

mod ops;
mod subject;
mod table;

use crate::{output, setup};
use anyhow::Result;
use aonet::net::cpu::{Level, Options, Precision};
use aonet_offline::timing;
use clap::Parser;
use std::path::PathBuf;

/// Sizes of the paper's Table 2, and of common screens.
const SIZES: [(usize, usize); 5] = [(540, 540), (1280, 720), (2048, 1024), (1920, 1080), (3840, 2160)];

/// Time methods on the CPU: features, network and clamping of a frame whose buffers are in memory.
///
/// `first` is what a program waits for its first image once a model is in memory: the session is made and run once. `GFLOP`
/// counts multiplications and additions of direct convolutions, at the size that the network pads to. `peak` is the most
/// memory that the process held while the row was measured, frame and parameters included. With --ops: every step of the
/// networks instead, beside what its multiplications and its memory traffic take at the peak rates of this machine, which are
/// measured as well.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet bench --threads 1 --threads 2 --size 1920x1080
  aonet bench --methods all
  aonet bench --config configs/models/speed.json --ops --size 1280x720
  aonet bench --classic all --size 1280x720")]
pub(crate) struct Args {
    /// Network; may be repeated [default: the shipped one that serves any radius].
    #[arg(long, value_name = "M.safetensors")]
    model: Vec<PathBuf>,
    /// Network of a configuration, of training or of the model alone, with random weights; may be repeated.
    #[arg(long, value_name = "C.json")]
    config: Vec<PathBuf>,
    /// Classic method, or `all`; may be repeated.
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// `all`: every classic method, and of the networks that come with the project every one that takes a time of its own.
    #[arg(long, value_parser = ["all"])]
    methods: Option<String>,
    /// Image size; may be repeated [default: the paper's 540x540, 1280x720, 2048x1024, and 1920x1080, 3840x2160].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Vec<(usize, usize)>,
    /// Threads; may be repeated [default: 1 and all cores].
    #[arg(long)]
    threads: Vec<usize>,
    /// Numbers that networks multiply, f32, bf16 or int8; may be repeated. A network that is not calibrated is, on the timed
    /// frame: for times only [default: f32].
    #[arg(long)]
    precision: Vec<Precision>,
    /// Counted runs, after the first.
    #[arg(long, default_value_t = 15)]
    runs: usize,
    /// Every step of the networks beside its floor.
    #[arg(long, conflicts_with = "classic")]
    ops: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A size [px] from `WxH`.
pub(crate) fn parse_size(text: &str) -> Result<(usize, usize)> {
    let (width, height) =
        text.split_once('x').ok_or_else(|| anyhow::anyhow!("expected WxH, such as 1280x720"))?;
    let size = (width.parse()?, height.parse()?);
    aonet::camera::check_size("--size", size.0, size.1)?;
    Ok(size)
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let subjects = subject::collect(args)?;
    match args.ops {
        true => ops::run(args, &subjects),
        false => table::run(args, &subjects),
    }
}

impl Args {
    fn sizes(&self) -> Vec<(usize, usize)> {
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

    fn precisions(&self) -> Vec<Precision> {
        if self.precision.is_empty() { vec![Precision::F32] } else { self.precision.clone() }
    }

    /// Every precision with every number of threads.
    fn options(&self) -> Vec<Options> {
        let options = |precision| {
            let with_threads = move |threads| Options { threads, precision, ..Options::default() };
            self.threads().into_iter().map(with_threads)
        };
        self.precisions().into_iter().flat_map(options).collect()
    }
}

/// What the times belong to.
fn machine() -> String {
    format!("{}, {:?}", timing::device(), Level::best())
}

/// Says on stderr what is measured now: a table of all methods takes minutes.
fn progress(name: &str, (width, height): (usize, usize), options: Options) {
    output::note(&format!("{name} {width}x{height}, {}, threads: {}", options.precision, options.threads));
}
