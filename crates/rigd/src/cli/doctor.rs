//! `rigd doctor`: what is wrong with a rig before it runs, and what to do.

use std::path::PathBuf;

use tokio::task::LocalSet;

use super::{Exit, fail, print};
use crate::doctor::{self, Consent, Grade, Report};
use crate::profile::Profile;
use crate::run::session::Links;
use crate::run::stop::StopRequests;
use crate::simulated;
use riglog::pair;

/// Look at ports, devices, watchdog and encoders, and say what to do; nothing moves without --turn.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The rig's profile [default: the simulated rig]
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Consent to one slow turn without load: encoder senses and indices. Clear the rig first
    #[arg(long)]
    turn: bool,
    /// Turn a servo that has no watchdog of its own; somebody must stay at the emergency stop
    #[arg(long)]
    accept_no_watchdog: bool,
    /// One JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let profile = match args.profile.as_deref().map_or_else(|| Ok(Profile::simulated()), Profile::load) {
        Ok(profile) => profile,
        Err(error) => return fail(Exit::BadInput, &error),
    };
    let simulated = profile.in_process();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(simulated).build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => return fail(Exit::Failed, &error),
    };
    let outcome = LocalSet::new().block_on(&runtime, async {
        let stop = StopRequests::listen().map_err(|error| format!("signals: {error}"))?;
        let links = if simulated { simulated_links()? } else { Links::default() };
        let consent = Consent { turn: args.turn, no_watchdog: args.accept_no_watchdog };
        Ok::<_, String>(doctor::examine(&profile, links, consent, &stop).await)
    });
    match outcome {
        Ok(report) => show(args, &profile, &report),
        Err(error) => {
            eprintln!("error: {error}");
            Exit::Failed
        }
    }
}

fn simulated_links() -> Result<Links, String> {
    let (_, model) = pair::load(None).map_err(|error| error.to_string())?;
    let spec = simulated::spec(&model, &[]).map_err(|error| error.to_string())?;
    simulated::start_in_process(&spec, rigsim::simulated_rig::IDLE_RATE_HZ, 1).map_err(|error| error.to_string())
}

fn show(args: &Args, profile: &Profile, report: &Report) -> Exit {
    let (faults, warnings) = (report.count(Grade::Fault), report.count(Grade::Warning));
    if args.json {
        let object = serde_json::json!({
            "schema": "rigd.doctor/1", "profile": profile.name, "faults": faults, "warnings": warnings,
            "findings": report.findings,
        });
        print(&object.to_string());
    } else {
        print(&format!("rig '{}'", profile.name));
        for finding in &report.findings {
            let mark = match finding.grade {
                Grade::Good => "ok     ",
                Grade::Warning => "warning",
                Grade::Fault => "FAULT  ",
            };
            print(&format!("{mark}  {:<20} {}", finding.subject, finding.found));
            if !finding.advice.is_empty() {
                print(&format!("{:>9}{:<20} → {}", "", "", finding.advice));
            }
        }
        print(&format!("{faults} faults, {warnings} warnings"));
    }
    if faults == 0 { Exit::Done } else { Exit::Failed }
}
