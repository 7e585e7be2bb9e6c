//! `rigd brake`: hold a brake torque for set-up, the motor off.

use std::cell::Cell;

use riglog::RunMetadata;
use serde_json::json;

use super::set_up::{self, Common, Task};
use super::{Exit, fail};
use crate::quantity::TORQUE;
use crate::run::admission::{Terms, admit_load};
use crate::run::connected_rig::ConnectedRig;
use crate::run::session;
use crate::run::set_up::hold_brake;

/// Hold a brake torque with the motor off, until Ctrl-C or for so many seconds, then set the brake to zero.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Load at the driven gear: 5Nm
    #[arg(value_name = "TORQUE", value_parser = |text: &str| TORQUE.parse(text))]
    load: f64,
    #[command(flatten)]
    common: Common,
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    let profile = match set_up::load(&args.common) {
        Ok(profile) => profile,
        Err(error) => return fail(Exit::BadInput, error.as_ref()),
    };
    if let Err(refusal) = admit_load(&profile, Terms::SET_POINTS, args.load) {
        return fail(Exit::BadInput, &refusal);
    }
    let drag_nm = profile.brake.drag_nm();
    if args.load < drag_nm {
        eprintln!("warning: {} N·m is below the brake's drag of {drag_nm} N·m; the drag remains", args.load);
    }
    let heat_j = Cell::new(0.0);
    let task = Task {
        name: format!("brake_{}Nm", args.load),
        opening: format!("the brake holds {} N·m for {} s at most; Ctrl-C ends it", args.load, args.common.seconds),
        conditions: RunMetadata { load_nm: vec![args.load], ..RunMetadata::default() },
        schema: "rigd.brake/1",
        figures: &|| json!({"load_nm": args.load, "heat_j": heat_j.get()}),
        words: &|| format!("{:.0} J above what the brake sheds are in its heat account", heat_j.get()),
    };
    set_up::execute(&args.common, profile, &task, async |rig: &mut ConnectedRig| {
        let hold = async |rig: &mut ConnectedRig| hold_brake(rig, args.load, args.common.seconds).await;
        let outcome = session::once(rig, hold).await;
        heat_j.set(rig.heat.heat_j());
        outcome
    })
}
