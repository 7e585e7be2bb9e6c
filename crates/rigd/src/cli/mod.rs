//! The command line. One command is one file; here they are only routed.

mod analyse;
mod audit;
mod blindtest;
mod brake;
mod calibrate;
mod campaign;
mod diagnose;
mod doctor;
mod export;
mod import;
mod info;
mod jog;
mod model;
mod on_rig;
mod profile;
mod prune;
mod recorded;
mod recover;
mod replay;
mod run;
mod serve;
mod set_up;
mod sim;
mod simulator;
mod stop;
mod verify;
mod withhold;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// How a command ended, as its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Failed: the reason is the last lines on stderr.
    Failed = 1,
    /// Bad usage or bad input; nothing was moved or written.
    BadInput = 2,
    /// Done, but the data is incomplete or cannot answer the question.
    Incomplete = 3,
    /// Stopped by the operator, log finalised.
    Stopped = 4,
    /// Stopped by a limit, a fault or a lost device, log finalised.
    Halted = 5,
}

const EXIT_CODES: &str = "Exit codes:
  0  done
  1  failed: the reason is the last lines on stderr
  2  bad usage or bad input, nothing was moved or written
  3  done, but the data is incomplete (loss, gap, truncated log) or cannot answer the question
  4  stopped by the operator, log finalised
  5  stopped by a limit, a fault or a lost device, log finalised";

/// Measures transmission error and backlash of gears, above all non-circular ones.
#[derive(Debug, Parser)]
#[command(name = "rigd", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Drive the rig, record a log, and compute TE and backlash
    Run(Box<run::Args>),
    /// Measure by a plan, each run in a log of its own; goes on where it ended
    Campaign(Box<campaign::Args>),
    /// Recompute TE and backlash from logs
    Replay(replay::Args),
    /// Order spectra, long and short waves, averages and noise floor of logs
    Analyse(analyse::Args),
    /// Say where model and logs disagree, which effect causes it, and how far the gap shrinks once it is added
    Diagnose(diagnose::Args),
    /// Compare logs with a model: the residual of every run against the rig's repeatability
    Verify(verify::Args),
    /// Say what is in a log
    Info(info::Args),
    /// Find what a rig's brake, encoders and zeros are, with uncertainties
    Calibrate(calibrate::Args),
    /// Check logs: every checksum, every sample's and message's number, both clocks
    Audit(audit::Args),
    /// Give logs that a killed run left behind their end
    Recover(recover::Args),
    /// List old logs, and delete them when told so
    Prune(prune::Args),
    /// Write the samples of a log as a table (CSV, Parquet, NumPy)
    Export(export::Args),
    /// Make a log from a table of angles (CSV, Parquet)
    Import(import::Args),
    /// Ask the model of a gear pair: TE, backlash, drawings, checks
    Model(Box<model::Args>),
    /// Start the simulated rig in real time, on ports of its own
    Sim(sim::Args),
    /// Make withheld cases on the simulated rig, diagnose them, and score the answers
    Blindtest(blindtest::Args),
    /// Check a rig's profile or a register map, or write a new profile
    Profile(profile::Args),
    /// Look at a rig before it runs and say what to do; nothing moves without --turn
    Doctor(doctor::Args),
    /// Show what the rig is doing, over HTTP; with a token, control it
    Serve(serve::Args),
    /// Turn slowly without load for set-up; needs consent (--turn)
    Jog(jog::Args),
    /// Hold a brake torque for set-up, the motor off
    Brake(brake::Args),
    /// End a run from another terminal, as Ctrl-C does
    Stop(stop::Args),
}

/// Parses the command line and runs the command.
#[must_use]
pub fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_env_filter(
            tracing_subscriber::EnvFilter::builder()
                .with_default_directive(tracing::level_filters::LevelFilter::WARN.into())
                .from_env_lossy(),
        )
        .without_time()
        .init();
    let exit = match Cli::parse().command {
        Command::Run(args) => run::main(&args),
        Command::Campaign(args) => campaign::main(&args),
        Command::Replay(args) => replay::main(&args),
        Command::Analyse(args) => analyse::main(&args),
        Command::Diagnose(args) => diagnose::main(&args),
        Command::Verify(args) => verify::main(&args),
        Command::Info(args) => info::main(&args),
        Command::Calibrate(args) => calibrate::main(&args),
        Command::Audit(args) => audit::main(&args),
        Command::Recover(args) => recover::main(&args),
        Command::Prune(args) => prune::main(&args),
        Command::Export(args) => export::main(&args),
        Command::Import(args) => import::main(&args),
        Command::Model(args) => model::main(&args),
        Command::Sim(args) => sim::main(&args),
        Command::Blindtest(args) => blindtest::main(&args),
        Command::Profile(args) => profile::main(&args),
        Command::Doctor(args) => doctor::main(&args),
        Command::Serve(args) => serve::main(&args),
        Command::Jog(args) => jog::main(&args),
        Command::Brake(args) => brake::main(&args),
        Command::Stop(args) => stop::main(&args),
    };
    ExitCode::from(exit as u8)
}

/// Prints an error with its causes and gives the exit code back.
fn fail(exit: Exit, error: &dyn std::error::Error) -> Exit {
    eprintln!("error: {error}");
    let said = error.to_string();
    let mut cause = error.source();
    while let Some(reason) = cause {
        let text = reason.to_string();
        if !said.contains(&text) {
            eprintln!("  because: {text}");
        }
        cause = reason.source();
    }
    exit
}

/// Prints to stdout; a reader that closed the pipe is not an error.
fn print(text: &str) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stdout(), "{text}");
}
