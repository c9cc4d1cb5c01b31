//! `model-export`: training and export of Bayesian networks.

use bnkf_model_export::cmd::{flights, import, inspect, moments, stress, train, tune, verify};
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
    Tune(tune::Args),
    Import(import::Args),
    Inspect(inspect::Args),
    Verify(verify::Args),
    Moments(moments::Args),
    Stress(stress::Args),
    Flights(flights::Args),
}

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::Train(args) => trained(train::run(&args)),
        Command::Tune(args) => trained(tune::run(&args)),
        Command::Import(args) => exit_code(import::run(&args)),
        Command::Inspect(args) => exit_code(inspect::run(&args)),
        Command::Verify(args) => exit_code(verify::run(&args)),
        Command::Moments(args) => exit_code(moments::run(&args)),
        Command::Stress(args) => exit_code(stress::run(&args)),
        Command::Flights(args) => exit_code(flights::run(&args)),
    }
}

fn trained(result: Result<train::Outcome, train::TrainError>) -> ExitCode {
    match result {
        Ok(train::Outcome::Written) => ExitCode::SUCCESS,
        Ok(train::Outcome::Interrupted) => ExitCode::from(INTERRUPTED),
        Err(error) => failure(&error),
    }
}

fn exit_code<E: std::fmt::Display>(result: Result<(), E>) -> ExitCode {
    result.map_or_else(|error| failure(&error), |()| ExitCode::SUCCESS)
}

fn failure(error: &dyn std::fmt::Display) -> ExitCode {
    eprintln!("error: {error}");
    ExitCode::FAILURE
}
