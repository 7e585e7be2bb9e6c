//! `rigd sim --withhold`: campaigns on the simulated rig whose faults are sealed.

use std::path::PathBuf;
use std::time::Instant;

use super::{Exit, fail, print};
use blindtest::family::Family;
use blindtest::generate::Baselines;
use blindtest::set::SetPlan;
use riglog::pair;

/// Arguments of withheld data.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Make withheld data instead: campaigns with faults drawn by this seed, logs without a trace of them, labels under seal
    #[arg(long, value_name = "SEED", requires = "out")]
    pub withhold: Option<u64>,
    /// Number of cases
    #[arg(long, default_value_t = 1, requires = "withhold", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub cases: u32,
    /// Directory of the logs; labels go to its subdirectory `sealed`
    #[arg(long, value_name = "DIR", requires = "withhold")]
    pub out: Option<PathBuf>,
    /// Only cases of one family [default: all of them, mixed]
    #[arg(long, value_enum, requires = "withhold")]
    pub family: Option<Family>,
}

/// Makes the set.
pub fn main(args: &Args, seed: u64, pair: Option<&std::path::Path>) -> Exit {
    let Some(out) = &args.out else { return Exit::BadInput };
    let pair_toml = match pair::load(pair) {
        Ok((text, _)) => text,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    if let Err(error) = std::fs::create_dir_all(out) {
        eprintln!("error: --out {}: {error}; name a directory that you may write", out.display());
        return Exit::BadInput;
    }
    let plan = SetPlan { seed, family: args.family, pair_toml, baselines: Baselines::default() };
    for number in 0..args.cases as usize {
        let started = Instant::now();
        match plan.generate(out, number) {
            Ok(path) => print(&format!("{}  ({:.1} s)", path.display(), started.elapsed().as_secs_f64())),
            Err(error) => return fail(Exit::Failed, &error),
        }
    }
    Exit::Done
}
