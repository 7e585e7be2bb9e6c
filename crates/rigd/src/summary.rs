//! The numbers at a run's end: one object for scripts (`contracts` of the command line), one text for people.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use gearmodel::Direction;
use gearmodel::measure::{Order, RunConditions, RunFigures, common_zero};
use serde::Serialize;

use crate::analysis::{Analysis, MeasuredBacklash};
use crate::present::{angle, arcsec};

/// `rigd.run/1` and `rigd.replay/1`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Schema and its version.
    pub schema: &'static str,
    /// The logs.
    pub log: Vec<String>,
    /// `sim`, or the profile's name.
    pub backend: String,
    /// Recorded samples of all runs.
    pub samples: u64,
    /// Samples that the counter numbered and that never arrived, of the whole log.
    pub losses: u64,
    /// Recorded time of all runs, s.
    pub duration_s: f64,
    /// TE of the last load, by sense.
    pub te: BTreeMap<&'static str, TeFigures>,
    /// Backlash of the last load; null until both senses are measured.
    pub backlash: Option<BacklashFigures>,
    /// Hash of every TE and backlash value, in order.
    pub te_hash: String,
    /// Every run.
    pub runs: Vec<RunEntry>,
    /// Every pair of runs in both senses.
    pub backlashes: Vec<BacklashFigures>,
    /// The picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plot: Option<String>,
    /// What happened on the lines of servo and brake; empty for a replay.
    #[serde(skip_serializing_if = "std::collections::BTreeMap::is_empty")]
    pub lines: BTreeMap<&'static str, crate::device::bus::BusStatistics>,
    /// What two readers' clocks are worth in TE; not of a counter box, nor of a replay, whose log has it as metadata `rig.clocks`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_skew: Option<TimeSkew>,
    /// How the run ended: `done`, or why not.
    pub ended: String,
    /// What one should know before believing the numbers.
    pub warnings: Vec<String>,
}

/// Two encoder readers have two clocks; what is not known of the time between them is an uncertainty of TE.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimeSkew {
    /// Standard uncertainty of the time between both readers, s.
    pub uncertainty_s: f64,
    /// What it is worth in TE at the steepest place and the fastest run, rad, one standard deviation.
    pub te_uncertainty_rad: f64,
    /// Drift of input and output reader against the host, parts per million.
    pub drift_ppm: [f64; 2],
    /// Lines of input and output reader that were not believed.
    pub refused_lines: [u64; 2],
}

/// One run's conditions and TE.
#[derive(Debug, Clone, Serialize)]
pub struct RunEntry {
    /// Sense.
    pub direction: &'static str,
    /// Load, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Revolutions recorded.
    pub revolutions: f64,
    /// Samples recorded.
    pub samples: u64,
    /// Samples lost within the run.
    pub losses: u64,
    /// Recorded time, s.
    pub duration_s: f64,
    /// The figures.
    pub te: TeFigures,
}

/// TE of one run, rad.
#[derive(Debug, Clone, Serialize)]
pub struct TeFigures {
    /// Mean of the mean curve.
    pub mean_rad: f64,
    /// Peak-to-peak of the mean curve.
    pub pp_rad: f64,
    /// RMS of the mean curve.
    pub rms_rad: f64,
    /// Peak-to-peak that the model predicts.
    pub predicted_pp_rad: f64,
    /// RMS of measured minus predicted, after the one zero that both senses share.
    pub residual_rms_rad: f64,
    /// Standard error of the mean curve by the scatter between revolutions; null for one revolution.
    pub floor_rms_rad: Option<f64>,
    /// That zero: mean of measured minus predicted over both senses.
    pub zero_rad: f64,
    /// Slope of the revolutions' means.
    pub offset_per_rev_rad: f64,
    /// F'is-like total transmission error: peak-to-peak over a revolution.
    pub f_is_total_rad: f64,
    /// f'is-like tooth-to-tooth error: largest peak-to-peak within one pitch.
    pub f_is_tooth_rad: f64,
    /// First orders of θ1, measured.
    pub orders: Vec<OrderFigures>,
    /// First orders of θ1, predicted.
    pub predicted_orders: Vec<OrderFigures>,
}

/// One order of the driver's turn.
#[derive(Debug, Clone, Serialize)]
pub struct OrderFigures {
    /// Cycles a turn.
    pub order: u32,
    /// Amplitude (half of peak-to-peak), rad.
    pub amplitude_rad: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

/// Backlash at one load, rad at the driven shaft.
#[derive(Debug, Clone, Serialize)]
pub struct BacklashFigures {
    /// Load, N·m.
    pub load_nm: f64,
    /// Speed of the driver, rpm.
    pub speed_rpm: f64,
    /// Least over a revolution.
    pub min_rad: f64,
    /// Mean.
    pub mean_rad: f64,
    /// Largest.
    pub max_rad: f64,
    /// Predicted least.
    pub predicted_min_rad: f64,
    /// Predicted mean.
    pub predicted_mean_rad: f64,
    /// Predicted largest.
    pub predicted_max_rad: f64,
    /// RMS of measured minus predicted.
    pub residual_rms_rad: f64,
}

fn orders(orders: &[Order]) -> Vec<OrderFigures> {
    orders
        .iter()
        .map(|order| OrderFigures {
            order: order.order,
            amplitude_rad: order.amplitude_rad,
            phase_rad: order.phase_rad,
        })
        .collect()
}

impl From<&RunFigures> for TeFigures {
    fn from(figures: &RunFigures) -> Self {
        Self {
            mean_rad: figures.mean_rad,
            pp_rad: figures.pp_rad,
            rms_rad: figures.rms_rad,
            predicted_pp_rad: figures.predicted_pp_rad,
            residual_rms_rad: figures.residual_rms_rad,
            floor_rms_rad: figures.floor_rms_rad.is_finite().then_some(figures.floor_rms_rad),
            zero_rad: figures.zero_rad,
            offset_per_rev_rad: figures.offset_per_rev_rad,
            f_is_total_rad: figures.f_is_total_rad,
            f_is_tooth_rad: figures.f_is_tooth_rad,
            orders: orders(&figures.orders),
            predicted_orders: orders(&figures.predicted_orders),
        }
    }
}

/// Where a summary comes from.
pub struct Origin {
    /// Schema.
    pub schema: &'static str,
    /// The logs.
    pub log: Vec<String>,
    /// `sim`, or the profile's name.
    pub backend: String,
    /// Losses of the whole log.
    pub losses: u64,
    /// How it ended.
    pub ended: String,
    /// Warnings so far.
    pub warnings: Vec<String>,
}

impl Summary {
    /// The summary of an analysis.
    #[must_use]
    pub fn of(analysis: &Analysis, origin: Origin) -> Self {
        let model = analysis.model();
        let curves: Vec<_> = analysis.runs().iter().map(|run| &run.te).collect();
        // The index zero is the set-up's own and common to all its runs.
        let zero = common_zero(&curves, model);
        let runs: Vec<RunEntry> = analysis
            .runs()
            .iter()
            .map(|run| {
                let conditions = run.te.conditions();
                let figures = RunFigures::of(&run.te, model, Some(zero));
                RunEntry {
                    direction: name(conditions.direction),
                    load_nm: conditions.load_nm,
                    speed_rpm: conditions.speed_rpm,
                    revolutions: run.te.revolutions() as f64,
                    samples: run.te.samples(),
                    losses: run.losses,
                    duration_s: run.duration_s,
                    te: TeFigures::from(&figures),
                }
            })
            .collect();
        let last_load = runs.last().map(|run| run.load_nm);
        let te = runs
            .iter()
            .filter(|run| Some(run.load_nm) == last_load)
            .map(|run| (run.direction, run.te.clone()))
            .collect();
        let backlashes: Vec<_> = analysis.backlash().iter().map(|measured| backlash(analysis, measured)).collect();
        Self {
            schema: origin.schema,
            log: origin.log,
            backend: origin.backend,
            samples: runs.iter().map(|run| run.samples).sum(),
            losses: origin.losses,
            // Not `sum`, which is -0 for no runs.
            duration_s: runs.iter().fold(0.0, |total, run| total + run.duration_s),
            te,
            backlash: backlashes.iter().rev().find(|figures| Some(figures.load_nm) == last_load).cloned(),
            te_hash: analysis.te_hash(),
            runs,
            backlashes,
            plot: None,
            lines: BTreeMap::new(),
            time_skew: None,
            ended: origin.ended,
            warnings: origin.warnings,
        }
    }

    /// The summary for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = self.write_text(&mut out);
        out
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        for run in &self.runs {
            let te = &run.te;
            writeln!(
                out,
                "\nTE {:<3}  {} N·m, {} rpm, {:.2} revolutions, {} samples, {} lost",
                run.direction, run.load_nm, run.speed_rpm, run.revolutions, run.samples, run.losses
            )?;
            writeln!(out, "  mean             {}", angle(te.mean_rad))?;
            writeln!(out, "  peak-to-peak     {}   predicted {}", angle(te.pp_rad), angle(te.predicted_pp_rad))?;
            writeln!(out, "  rms              {}", angle(te.rms_rad))?;
            writeln!(
                out,
                "  F'is (total)     {}   f'is (tooth to tooth) {}",
                angle(te.f_is_total_rad),
                angle(te.f_is_tooth_rad)
            )?;
            let list = |orders: &[OrderFigures]| {
                orders
                    .iter()
                    .map(|o| format!("{}: {:.2}\"", o.order, arcsec(o.amplitude_rad)))
                    .collect::<Vec<_>>()
                    .join("  ")
            };
            writeln!(out, "  orders of θ1     {}   predicted {}", list(&te.orders), list(&te.predicted_orders))?;
            writeln!(out, "  offset per rev   {}", angle(te.offset_per_rev_rad))?;
            writeln!(out, "  measured against predicted: {} rms {}", angle(te.residual_rms_rad), verdict(te))?;
        }
        for backlash in &self.backlashes {
            writeln!(out, "\nbacklash  {} N·m, {} rpm", backlash.load_nm, backlash.speed_rpm)?;
            writeln!(out, "  min   {}   predicted {}", angle(backlash.min_rad), angle(backlash.predicted_min_rad))?;
            writeln!(out, "  mean  {}   predicted {}", angle(backlash.mean_rad), angle(backlash.predicted_mean_rad))?;
            writeln!(out, "  max   {}   predicted {}", angle(backlash.max_rad), angle(backlash.predicted_max_rad))?;
            writeln!(out, "  measured against predicted: {} rms", angle(backlash.residual_rms_rad))?;
        }
        writeln!(out, "\nsamples {}   lost {}   recorded {:.1} s", self.samples, self.losses, self.duration_s)?;
        if let Some(skew) = &self.time_skew {
            let [input, output] = skew.drift_ppm;
            writeln!(
                out,
                "clocks  two readers, known to {:.2} ms: TE ± {} (1σ); drift {input:.1} and {output:.1} ppm; {} lines refused",
                skew.uncertainty_s * 1e3,
                angle(skew.te_uncertainty_rad),
                skew.refused_lines[0] + skew.refused_lines[1]
            )?;
        }
        for log in &self.log {
            writeln!(out, "log     {log}")?;
        }
        for (device, line) in &self.lines {
            writeln!(out, "{device:<7} {line}")?;
        }
        if let Some(plot) = &self.plot {
            writeln!(out, "plot    {plot}")?;
        }
        writeln!(out, "te_hash {}", self.te_hash)?;
        if self.ended != "done" {
            writeln!(out, "ended   {}", self.ended)?;
        }
        Ok(())
    }
}

/// How the residual stands against repeatability.
fn verdict(te: &TeFigures) -> String {
    match te.floor_rms_rad {
        None => "(one revolution: no repeatability floor; record two or more)".into(),
        Some(floor) => {
            let times = te.residual_rms_rad / floor;
            let meaning =
                if times < 3.0 { "the model agrees within the noise" } else { "something is not in the model" };
            format!("= {times:.1} × the repeatability floor of {} — {meaning}", angle(floor))
        }
    }
}

fn backlash(analysis: &Analysis, measured: &MeasuredBacklash) -> BacklashFigures {
    let RunConditions { load_nm, speed_rpm, .. } = measured.conditions;
    let predicted = analysis.predicted_backlash(&measured.conditions);
    let differences: Vec<f64> = measured
        .curve
        .curve
        .values_rad
        .iter()
        .zip(&predicted.curve.values_rad)
        .map(|(measured, predicted)| measured - predicted)
        .filter(|difference| difference.is_finite())
        .collect();
    let residual = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len().max(1) as f64).sqrt();
    BacklashFigures {
        load_nm,
        speed_rpm,
        min_rad: measured.curve.min_rad,
        mean_rad: measured.curve.mean_rad,
        max_rad: measured.curve.max_rad,
        predicted_min_rad: predicted.min_rad,
        predicted_mean_rad: predicted.mean_rad,
        predicted_max_rad: predicted.max_rad,
        residual_rms_rad: residual,
    }
}

/// The sense as logs and scripts name it.
#[must_use]
pub fn name(direction: Direction) -> &'static str {
    match direction {
        Direction::Ccw => "ccw",
        Direction::Cw => "cw",
    }
}
