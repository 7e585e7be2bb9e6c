//! `rigd calibrate zero`.

use gearmodel::Direction;
use gearmodel::calibration::{COVERAGE, CalibrationError, Zero, zero};
use gearmodel::measure::RunTe;
use serde_json::json;

use super::super::Exit;
use super::super::recorded::Recorded;
use super::{CalibrateError, Output, date, names, record};
use crate::calibration::{Calibration, ZeroCalibration};
use crate::present::arcsec;
use crate::replay::model_for;

/// Where the indices stand against the gears' zero
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    recorded: Recorded,
    #[command(flatten)]
    output: Output,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, CalibrateError> {
    let (model, rig) = model_for(&args.recorded.logs[0], args.recorded.pair.as_deref())?;
    let recorded = record(&args.recorded.logs, &model.pair)?;
    let mut best: Option<Zero> = None;
    for log in &recorded {
        for ccw in log.runs.iter().filter(|run| run.conditions().direction == Direction::Ccw) {
            let Some(cw) = log.runs.iter().find(|run| is_partner(ccw, run)) else { continue };
            let load_nm = ccw.conditions().load_nm;
            let found = zero(&model, &ccw.mean_curve(), &cw.mean_curve(), load_nm)?;
            if best.is_none_or(|best| found.input_uncertainty_rad < best.input_uncertainty_rad) {
                best = Some(found);
            }
        }
    }
    let found = best.ok_or(CalibrateError::Calibration(CalibrationError::OneSense))?;
    let index_counts = recorded
        .iter()
        .filter_map(|log| log.encoders)
        .map(|encoders| {
            let within = |counts: i64, turn: u64| counts.rem_euclid(i64::try_from(turn).unwrap_or(i64::MAX).max(1));
            [
                within(encoders.input_index_counts, encoders.input_counts_per_rev),
                within(encoders.output_index_counts, encoders.output_counts_per_rev),
            ]
        })
        .collect();
    let zero = ZeroCalibration {
        date: date(),
        rig,
        method: "TE of both senses against the ratio: z2 − i z1, what the model knows taken off".into(),
        coverage_factor: COVERAGE,
        input_rad: found.input_rad,
        input_uncertainty_rad: found.input_uncertainty_rad,
        output_rad: found.output_rad,
        output_uncertainty_rad: found.output_uncertainty_rad,
        residual_rms_rad: found.residual_rms_rad,
        index_counts,
        logs: names(&recorded),
    };
    let mut calibration = Calibration::load_or_new(&args.output.out)?;
    calibration.zero = Some(zero.clone());
    calibration.save(&args.output.out)?;
    let told = json!({
        "schema": "rigd.calibrate/1", "what": "zero", "file": args.output.out.display().to_string(), "zero": zero,
    });
    let text = format!(
        "θ1 reads {:+.2}″ ± {:.2}″ at the gears' zero, θ2 {:+.2}″ ± {:.2}″; left of TE: {:.2}″ RMS\n\
         a first-order eccentricity of either encoder leaves the same trace as θ1's zero: calibrate the encoders first\nwritten to {}",
        arcsec(zero.input_rad),
        arcsec(zero.input_uncertainty_rad),
        arcsec(zero.output_rad),
        arcsec(zero.output_uncertainty_rad),
        arcsec(zero.residual_rms_rad),
        args.output.out.display()
    );
    args.output.tell(&told, &text);
    Ok(if recorded.iter().all(|log| log.complete) { Exit::Done } else { Exit::Incomplete })
}

/// The other sense at the same load and speed.
fn is_partner(ccw: &RunTe, other: &RunTe) -> bool {
    let (one, two) = (ccw.conditions(), other.conditions());
    two.direction == Direction::Cw && one.load_nm == two.load_nm && one.speed_rpm == two.speed_rpm
}
