//! `rigd calibrate encoder`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use gearmodel::calibration::{COVERAGE, MountedRun, encoder_errors};
use gearmodel::effect::Shaft;
use serde_json::json;

use super::super::Exit;
use super::{CalibrateError, Output, Recorded, date, key, names, record};
use crate::calibration::{Calibration, EncoderCalibration};
use crate::present::arcsec;
use crate::replay::model_for;

/// Errors of an encoder's disc
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which encoder was turned on its shaft
    #[arg(value_enum)]
    encoder: Which,
    /// Logs of the same runs at each mounting; the profile of each says how the disc was mounted
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Highest order, periods a turn
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=32))]
    highest: u32,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    Input,
    Output,
}

impl Which {
    fn mounted_deg(self, log: &Recorded) -> f64 {
        match self {
            Self::Input => log.profile.counter.input_mounted_deg,
            Self::Output => log.profile.counter.output_mounted_deg,
        }
    }

    fn other(self) -> (Self, &'static str) {
        match self {
            Self::Input => (Self::Output, "output"),
            Self::Output => (Self::Input, "input"),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, CalibrateError> {
    let (model, rig) = model_for(&args.logs[0], None)?;
    let recorded = record(&args.logs, &model.pair)?;
    let (other, name) = args.encoder.other();
    let first_deg = other.mounted_deg(&recorded[0]);
    if let Some(turned) = recorded.iter().find(|log| other.mounted_deg(log) != first_deg) {
        return Err(CalibrateError::BothTurned { other: name, first_deg, second_deg: other.mounted_deg(turned) });
    }
    let mut groups = BTreeMap::new();
    let mut runs = Vec::new();
    for log in &recorded {
        for run in &log.runs {
            let (direction, load, speed) = key(run);
            let next = groups.len();
            let group = *groups.entry((direction.as_str(), load, speed)).or_insert(next);
            let revolutions: Vec<_> = run.whole_revolutions().map(|(_, curve)| curve).collect();
            if !revolutions.is_empty() {
                runs.push(MountedRun { mounting_rad: args.encoder.mounted_deg(log).to_radians(), group, revolutions });
            }
        }
    }
    if runs.is_empty() {
        return Err(CalibrateError::NoRun);
    }
    let shaft = if args.encoder == Which::Input { Shaft::Input } else { Shaft::Output };
    let found = encoder_errors(shaft, &model.pair, &runs, args.highest)?;
    let disc = EncoderCalibration {
        date: date(),
        rig,
        method: format!("{} mountings of the disc, runs of the same sense, load and speed compared", found.mountings),
        coverage_factor: COVERAGE,
        orders: found
            .orders
            .iter()
            .map(|one| [f64::from(one.order), one.eps_rad, one.phase_rad, one.uncertainty_rad])
            .collect(),
        untold_orders: found.untold.clone(),
        residual_rms_rad: found.residual_rms_rad,
        logs: names(&recorded),
    };
    let mut calibration = Calibration::load_or_new(&args.output.out)?;
    match args.encoder {
        Which::Input => calibration.encoder_input = Some(disc.clone()),
        Which::Output => calibration.encoder_output = Some(disc.clone()),
    }
    calibration.save(&args.output.out)?;
    let documented = documented(args.encoder, &disc);
    let told = json!({
        "schema": "rigd.calibrate/1", "what": "encoder", "encoder": if args.encoder == Which::Input { "input" } else { "output" },
        "file": args.output.out.display().to_string(), "disc": disc, "documented": documented,
    });
    let mut text = String::new();
    for [order, eps, phase, uncertainty] in &disc.orders {
        text.push_str(&format!(
            "order {order:>2}: {:.3}″ ± {:.3}″, phase {phase:+.4} rad\n",
            arcsec(*eps),
            arcsec(*uncertainty)
        ));
    }
    for order in &disc.untold_orders {
        text.push_str(&format!("order {order:>2}: not told by {} mountings\n", found.mountings));
    }
    text.push_str(&format!("left between the mountings: {:.3}″ RMS\n", arcsec(disc.residual_rms_rad)));
    if !documented.is_empty() {
        text.push_str(&format!("for pair.toml, so that the model contains it:\n{documented}"));
    }
    text.push_str(&format!("written to {}", args.output.out.display()));
    args.output.tell(&told, &text);
    Ok(if recorded.iter().all(|log| log.complete) { Exit::Done } else { Exit::Incomplete })
}

/// Orders 1 and 2 as the pair file documents them, where they stand out of their uncertainty.
fn documented(encoder: Which, disc: &EncoderCalibration) -> String {
    let number = if encoder == Which::Input { 1 } else { 2 };
    let mut text = String::new();
    for [order, eps, phase, uncertainty] in &disc.orders {
        let name = match *order as u32 {
            1 => "eccentricity",
            2 => "ellipticity",
            _ => continue,
        };
        if eps > uncertainty {
            text.push_str(&format!("[documented.encoder{number}_{name}]\neps = {eps:e}\nphase_rad = {phase:.6}\n"));
        }
    }
    text
}
