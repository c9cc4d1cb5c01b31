//! `model-export`: training and export of Bayesian networks.

use bnkf_model_export::cmd::train;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Exit code after Ctrl-C, as a shell gives it.
const INTERRUPTED: u8 = 130;

/// Trains variational Bayesian networks for the tracker and writes them as blobs.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Train(train::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Train(args) => train::run(&args).map(|outcome| match outcome {
            train::Outcome::Written => ExitCode::SUCCESS,
            train::Outcome::Interrupted => ExitCode::from(INTERRUPTED),
        }),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}
