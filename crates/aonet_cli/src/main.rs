//! The `aonet` program: one file a command. stdout is the result, stderr is for people.

mod device;
mod frame_args;
mod names;
mod output;
mod radius;
mod setup;

mod cmd {
    pub(crate) mod bench;
    pub(crate) mod bent;
    pub(crate) mod calibrate;
    pub(crate) mod classic;
    pub(crate) mod compare;
    pub(crate) mod dataset;
    pub(crate) mod demo;
    pub(crate) mod eval;
    pub(crate) mod exact_shares;
    pub(crate) mod export;
    pub(crate) mod flicker;
    pub(crate) mod gallery;
    pub(crate) mod infer;
    pub(crate) mod info;
    pub(crate) mod ladder;
    pub(crate) mod paper;
    pub(crate) mod render;
    pub(crate) mod trace;
    pub(crate) mod train;
    pub(crate) mod tune;
    pub(crate) mod view;
}

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// Ambient occlusion learned from traced rays in screen space, by a small neural network.
///
/// Exit status: 0 done, 1 a requested check failed, 2 could not run.
#[derive(Debug, Parser)]
#[command(name = "aonet", version, after_help = "Start with: aonet demo")]
struct Cli {
    /// Print more on stderr; twice for even more.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(cmd::demo::Args),
    Infer(cmd::infer::Args),
    Classic(cmd::classic::Args),
    Render(cmd::render::Args),
    Trace(cmd::trace::Args),
    Compare(cmd::compare::Args),
    Gallery(cmd::gallery::Args),
    Dataset(cmd::dataset::Args),
    Train(cmd::train::Args),
    Tune(cmd::tune::Args),
    Calibrate(cmd::calibrate::Args),
    Eval(cmd::eval::Args),
    Flicker(cmd::flicker::Args),
    Ladder(cmd::ladder::Args),
    ExactShares(cmd::exact_shares::Args),
    Bent(cmd::bent::Args),
    Export(cmd::export::Args),
    Info(cmd::info::Args),
    Bench(cmd::bench::Args),
    Paper(cmd::paper::Args),
    View(cmd::view::Args),
    /// Print a script that completes commands and options in a shell.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
}

/// Outcome of a command that could run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The command is done.
    Done,
    /// A requested check failed.
    CheckFailed,
}

/// A step of training allocates and frees every activation.
#[cfg(feature = "train")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let cli = parse();
    let level = [log::LevelFilter::Warn, log::LevelFilter::Debug, log::LevelFilter::Trace]
        [usize::from(cli.verbose.min(2))];
    let mut logger = env_logger::Builder::new();
    logger.filter_level(level);
    // The shader compiler logs details of every shader.
    for part in ["naga", "wgpu_core", "wgpu_hal"] {
        logger.filter_module(part, log::LevelFilter::Warn);
    }
    // It warns of what becomes an error of ours.
    logger.filter_module("cubecl_common", log::LevelFilter::Error);
    logger.init();
    match run(cli.command) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(err) => {
            output::note(&format!("aonet: {err:#}"));
            ExitCode::from(2)
        }
    }
}

fn parse() -> Cli {
    Cli::from_arg_matches(&command_line().get_matches()).unwrap_or_else(|e| e.exit())
}

/// The command line. Options take negative numbers, so that a range error names the value and not a flag.
fn command_line() -> clap::Command {
    let names: Vec<_> = Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let negative = |arg: clap::Arg| {
        let takes_values = arg.get_action().takes_values() && !arg.is_positional();
        arg.allow_negative_numbers(takes_values)
    };
    names
        .into_iter()
        .fold(Cli::command(), |cli, name| cli.mut_subcommand(name, |command| command.mut_args(negative)))
}

fn run(command: Command) -> anyhow::Result<Outcome> {
    match command {
        Command::Demo(args) => cmd::demo::run(&args)?,
        Command::Infer(args) => cmd::infer::run(&args)?,
        Command::Classic(args) => cmd::classic::run(&args)?,
        Command::Render(args) => cmd::render::run(&args)?,
        Command::Trace(args) => cmd::trace::run(&args)?,
        Command::Compare(args) => return cmd::compare::run(&args),
        Command::Gallery(args) => cmd::gallery::run(&args)?,
        Command::Dataset(args) => cmd::dataset::run(args)?,
        Command::Train(args) => cmd::train::run(args)?,
        Command::Tune(args) => cmd::tune::run(&args)?,
        Command::Calibrate(args) => cmd::calibrate::run(&args)?,
        Command::Eval(args) => cmd::eval::run(&args)?,
        Command::Flicker(args) => cmd::flicker::run(&args)?,
        Command::Ladder(args) => cmd::ladder::run(&args)?,
        Command::ExactShares(args) => cmd::exact_shares::run(&args)?,
        Command::Bent(args) => cmd::bent::run(&args)?,
        Command::Export(args) => cmd::export::run(&args)?,
        Command::Info(args) => cmd::info::run(&args)?,
        Command::Bench(args) => cmd::bench::run(&args)?,
        Command::Paper(args) => cmd::paper::run(&args)?,
        Command::View(args) => cmd::view::run(args)?,
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "aonet", &mut script);
            output::text(&String::from_utf8_lossy(&script))?;
        }
    }
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    /// The commands in the help of a command and of its subcommands.
    fn examples(of: &clap::Command) -> Vec<String> {
        let help = of.get_after_long_help().or(of.get_after_help()).map(ToString::to_string);
        let lines = help.iter().flat_map(|help| help.lines());
        // A note may stand behind a command, in brackets.
        let commands = lines.flat_map(|line| line.split("   (").next().unwrap_or(line).split(" && "));
        let found = commands.map(str::trim).filter(|line| line.starts_with("aonet ")).map(str::to_owned);
        found.chain(of.get_subcommands().flat_map(examples)).collect()
    }

    #[test]
    fn every_example_of_the_help_is_a_command_line() {
        let examples = examples(&command_line());
        assert!(examples.len() > 40, "{examples:?}");
        for line in examples {
            // Two spaces stand before it; help in a pipe is 100 letters wide.
            assert!(line.len() <= 98, "does not fit on a line of the help: {line}");
            let parsed = command_line().try_get_matches_from(line.split_whitespace());
            assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
        }
    }
}
