//! `host-sim`: the simulated measurement loop.

use std::process::ExitCode;

use bnkf_host_sim::cmd::evaluate;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(
    version,
    about = "Simulated measurement loop of the Bayesian neural Kalman tracker"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Evaluate(evaluate::Args),
}

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::Evaluate(args) => exit_code(evaluate::run(&args)),
    }
}

fn exit_code<E: std::fmt::Display>(result: Result<(), E>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
