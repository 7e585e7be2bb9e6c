//! `rigd jog`: turn slowly without load for set-up.

use std::cell::Cell;
use std::f64::consts::TAU;

use gearmodel::Direction;
use riglog::RunMetadata;
use serde_json::json;

use super::set_up::{self, Common, Refusal, Task};
use super::{Exit, fail};
use crate::quantity::SPEED;
use crate::run::admission::{Terms, admit_speed};
use crate::run::connected_rig::ConnectedRig;
use crate::run::session;
use crate::run::set_up::{Jog, LARGEST_RPM, jog};

/// Turn the driver slowly without load, until Ctrl-C, or for so many turns or seconds.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Consent: the rig is clear and nobody touches it
    #[arg(long)]
    turn: bool,
    /// Sense of rotation of the driver
    #[arg(long, value_enum, default_value = "ccw")]
    direction: Sense,
    /// Speed of the driver, at most 10 rpm
    #[arg(long, value_name = "RPM", default_value = "3", value_parser = |text: &str| SPEED.parse(text))]
    rpm: f64,
    /// End after so many turns of the driver
    #[arg(long, value_name = "TURNS", value_parser = turns)]
    turns: Option<f64>,
    /// Drive a servo that has no watchdog of its own; somebody must stay at the emergency stop
    #[arg(long)]
    accept_no_watchdog: bool,
    #[command(flatten)]
    common: Common,
}

/// One sense.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Sense {
    Ccw,
    Cw,
}

fn turns(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("'{text}' is no number of turns; write 0.5"))?;
    if value > 0.0 && value <= 1000.0 { Ok(value) } else { Err(format!("{text} is not within 0 and 1000 turns")) }
}

/// Runs the command.
pub fn main(args: &Args) -> Exit {
    if !args.turn {
        return fail(Exit::BadInput, &Refusal::NoConsent);
    }
    let profile = match set_up::load(&args.common) {
        Ok(profile) => profile,
        Err(error) => return fail(Exit::BadInput, error.as_ref()),
    };
    if args.rpm > LARGEST_RPM {
        return fail(Exit::BadInput, &Refusal::TooFast { speed_rpm: args.rpm });
    }
    if let Err(refusal) = admit_speed(&profile, Terms::OPTIONS, args.rpm) {
        return fail(Exit::BadInput, &refusal);
    }
    let direction = if args.direction == Sense::Ccw { Direction::Ccw } else { Direction::Cw };
    let plan = Jog {
        direction,
        speed_rpm: args.rpm,
        turns: args.turns,
        seconds: args.common.seconds,
        accept_no_watchdog: args.accept_no_watchdog,
    };
    let (from_rad, to_rad) = (Cell::new(f64::NAN), Cell::new(f64::NAN));
    // None where it never came to turning.
    let turned = || Some((to_rad.get() - from_rad.get()) / TAU).filter(|turns| turns.is_finite());
    let words = || match turned() {
        None => "the driver was not turned".to_owned(),
        Some(turns) if turns * direction.sign() < 0.0 => format!(
            "the driver turned {turns:+.3} turns by its encoder, against {direction}: set counter.input_sign or servo.sense the other way"
        ),
        Some(turns) => format!("the driver turned {turns:+.3} turns (+ = ccw) by its encoder"),
    };
    let task = Task {
        name: format!("jog_{direction}_{}rpm", args.rpm),
        opening: format!(
            "turns the driver {direction} at {} rpm for {} s at most; Ctrl-C ends it",
            args.rpm, args.common.seconds
        ),
        conditions: RunMetadata {
            direction: direction.to_string(),
            load_nm: vec![0.0],
            speed_rpm: vec![args.rpm],
            ..RunMetadata::default()
        },
        schema: "rigd.jog/1",
        figures: &|| json!({"direction": direction.to_string(), "speed_rpm": args.rpm, "turned_rad": turned().map(|turns| turns * TAU)}),
        words: &words,
    };
    set_up::execute(&args.common, profile, &task, async |rig: &mut ConnectedRig| {
        let outcome = session::once(rig, async |rig: &mut ConnectedRig| jog(rig, plan, &from_rad).await).await;
        to_rad.set(rig.acquisition.borrow().latest.theta1_rad);
        outcome
    })
}
