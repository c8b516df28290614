//! The `aonet` program.

use clap::{Parser, Subcommand};

mod cmd {
    pub(crate) mod dataset;
    pub(crate) mod train;
}

/// Ambient occlusion of ray-traced quality in screen space.
#[derive(Parser)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Dataset(cmd::dataset::Args),
    Train(cmd::train::Args),
}

fn main() {
    let result = match Cli::parse().command {
        Command::Dataset(args) => cmd::dataset::run(args),
        Command::Train(args) => cmd::train::run(args),
    };
    if let Err(err) = result {
        eprintln!("aonet: {err:#}");
        std::process::exit(2);
    }
}
