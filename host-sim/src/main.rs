//! `host-sim`: the simulated measurement loop.

use std::process::ExitCode;

use bnkf_host_sim::cmd::{demo, doubt, evaluate, image, readings, replicate, score, track};
use clap::{Parser, Subcommand};

/// Simulated measurement loop of the Bayesian neural Kalman tracker.
///
/// Without a command: the paper's five methods and the recursive tracker on built-in flights, a
/// table and two figures.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    demo: demo::Args,
}

#[derive(Subcommand)]
enum Command {
    Evaluate(evaluate::Args),
    Doubt(doubt::Args),
    Image(image::Args),
    Readings(readings::Args),
    Score(score::Args),
    Track(track::Args),
    Replicate(replicate::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match cli.command {
        None => exit_code(demo::run(&cli.demo)),
        Some(Command::Evaluate(args)) => exit_code(evaluate::run(&args)),
        Some(Command::Doubt(args)) => exit_code(doubt::run(&args)),
        Some(Command::Image(args)) => exit_code(image::run(&args)),
        Some(Command::Readings(args)) => exit_code(readings::run(&args)),
        Some(Command::Score(args)) => exit_code(score::run(&args)),
        Some(Command::Track(args)) => exit_code(track::run(&args)),
        Some(Command::Replicate(args)) => exit_code(replicate::run(&args)),
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
