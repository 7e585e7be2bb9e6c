//! `rigd sim`: the simulated rig in real time, as a process of its own.

use std::path::PathBuf;

use tokio::task::LocalSet;

use super::{Exit, fail, withhold};
use crate::profile::Profile;
use crate::run::stop::StopRequests;
use crate::simulated;
use riglog::pair;

/// Start the simulated rig in real time, on ports of its own.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Directory of the ports and of profile.toml
    #[arg(long, value_name = "DIR", default_value = "sim")]
    pty_dir: PathBuf,
    /// Seed of all noise and of the start position
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The gear pair [default: the built-in pair]
    #[arg(long, value_name = "FILE")]
    pair: Option<PathBuf>,
    /// An effect that the model does not know; may be repeated
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    undocumented: Vec<String>,
    /// Write a table of the true shaft speeds, whatever encoders and drives say
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Take commands from standard input, a line each: `estop press`, `estop release`, `heat CELSIUS`,
    /// `overcurrent FACTOR`, `no-watchdog`, `counter restart`,
    /// `reader input restart`, `reader output restart`
    #[arg(long)]
    commands: bool,
    /// Two QSB readers beside the counter box, on ports `input` and `output`; their profile is qsb.toml
    #[arg(long)]
    qsb: bool,
    /// How much faster the output reader's clock goes than the input's, ppm
    #[arg(long, value_name = "PPM", default_value_t = 40.0, allow_negative_numbers = true, requires = "qsb")]
    qsb_drift: f64,
    /// How far the output reader's clock is ahead of the input's, s
    #[arg(long, value_name = "S", default_value_t = 1.7, allow_negative_numbers = true, requires = "qsb")]
    qsb_offset: f64,
    #[command(flatten)]
    withhold: withhold::Args,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    if let Some(seed) = args.withhold.withhold {
        return withhold::main(&args.withhold, seed, args.pair.as_deref());
    }
    let spec = match pair::load(args.pair.as_deref()) {
        Ok((_, model)) => simulated::spec(&model, &args.undocumented),
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let spec = match spec {
        Ok(spec) => spec,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    if let Err(error) = std::fs::create_dir_all(&args.pty_dir) {
        eprintln!("error: --pty-dir {}: {error}; name a directory that you may write", args.pty_dir.display());
        return Exit::BadInput;
    }
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return fail(Exit::Failed, &error),
    };
    for (option, value, most) in [("--qsb-drift", args.qsb_drift, 1e4), ("--qsb-offset", args.qsb_offset, 1e6)] {
        if value.is_nan() || value.abs() > most || (option == "--qsb-offset" && value < 0.0) {
            eprintln!(
                "error: {option} {value} must be from {} to {most}",
                if option == "--qsb-drift" { -most } else { 0.0 }
            );
            return Exit::BadInput;
        }
    }
    let readers = args.qsb.then(|| {
        let output = rigsim::emulator::QsbClock { offset_s: args.qsb_offset, fast_ppm: args.qsb_drift };
        [rigsim::emulator::QsbClock::default(), output]
    });
    let extras = simulated::Extras { record: args.record.clone(), commands: args.commands, readers };
    let outcome = LocalSet::new().block_on(&runtime, async {
        let stop =
            StopRequests::listen().map_err(|source| simulated::SimError::Io { what: "signals".into(), source })?;
        simulated::serve_ptys(&spec, args.seed, &args.pty_dir, &Profile::simulated(), &extras, stop).await
    });
    match outcome {
        Ok(()) => Exit::Done,
        Err(error) => {
            eprintln!("error: simulated rig in {}: {error}", args.pty_dir.display());
            Exit::Failed
        }
    }
}
