//! The `aonet` program.

use clap::{Parser, Subcommand};

mod cmd {
    pub(crate) mod dataset;
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
}

fn main() {
    let result = match Cli::parse().command {
        Command::Dataset(args) => cmd::dataset::run(args),
    };
    if let Err(err) = result {
        eprintln!("aonet: {err:#}");
        std::process::exit(2);
    }
}
