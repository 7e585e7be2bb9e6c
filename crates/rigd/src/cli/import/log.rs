//! Samples of a table as a rig log: counts from angles, runs as stretches of phase RECORD, TE beside them.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use gearmodel::measure::{AngleGrid, RunConditions};
use riglog::proto::{self, Level, Phase, RigState, Timestamp};
use riglog::{AngleScale, BatchBuilder, EncoderMetadata, LogWriter, RunMetadata};

use super::error::ImportError;
use super::rows::{Conditions, Row};
use crate::analysis::Analysis;

/// Samples a message.
const BATCH: usize = 1000;
/// A state is written at each run's edges and this often in between.
const STATE_PERIOD_NS: u64 = 1_000_000_000;
/// Between runs whose clocks start anew.
const PAUSE_NS: u64 = 1_000_000_000;
/// A run of fewer samples that ends because a set-point changed is no run: the column holds readings.
const FEWEST_SAMPLES: u64 = 10;
/// Travel below which noise may look like motion in the other sense, rad.
const CLEAR_TRAVEL_RAD: f64 = 0.1;
/// Counts are exact in an f64 up to here.
const LARGEST_COUNT: f64 = 9_007_199_254_740_992.0;

/// Encoders that count `counts_per_rev` and have their zero where the table has it.
pub fn encoders(counts_per_rev: u64) -> EncoderMetadata {
    EncoderMetadata {
        input_counts_per_rev: counts_per_rev,
        output_counts_per_rev: counts_per_rev,
        // The discs are not known: a count a line, nothing interpolated.
        input_lines: counts_per_rev,
        output_lines: counts_per_rev,
        input_index_counts: 0,
        output_index_counts: 0,
        input_sign: 1,
        output_sign: 1,
    }
}

/// A run under way.
struct Run {
    conditions: Conditions,
    first: Row,
    last: Row,
    /// First and last angles that are there.
    travel_rad: Option<([f64; 2], [f64; 2])>,
    start_ns: u64,
    last_ns: u64,
    step_ns: u64,
    next_state_ns: u64,
    samples: u64,
    lost: u64,
}

/// Writes a log from rows.
pub struct Importer {
    table: PathBuf,
    writer: LogWriter,
    analysis: Analysis,
    counts_per_rev: u64,
    scale: AngleScale,
    batch: BatchBuilder,
    run: Option<Run>,
    /// Added to the table's times, so that the log's never run back.
    shift_ns: u64,
    sample: u64,
    lost: u64,
    samples: u64,
    largest_rounding_rad: f64,
    warnings: Vec<String>,
    loads_nm: Vec<f64>,
    speeds_rpm: Vec<f64>,
    directions: Vec<&'static str>,
}

/// What came of an import.
pub struct Imported {
    /// TE and backlash of the counts in the log.
    pub analysis: Analysis,
    /// Samples without an angle.
    pub lost: u64,
    /// Largest difference between an angle of the table and of the log, rad.
    pub largest_rounding_rad: f64,
    /// What one should know.
    pub warnings: Vec<String>,
}

impl Importer {
    /// An importer of `table` into a log that was just made.
    pub fn new(table: &Path, writer: LogWriter, analysis: Analysis, counts_per_rev: u64) -> Self {
        Self {
            table: table.into(),
            writer,
            analysis,
            counts_per_rev,
            scale: encoders(counts_per_rev).theta1(),
            batch: BatchBuilder::new(BATCH),
            run: None,
            shift_ns: 0,
            sample: 0,
            lost: 0,
            samples: 0,
            largest_rounding_rad: 0.0,
            warnings: Vec::new(),
            loads_nm: Vec::new(),
            speeds_rpm: Vec::new(),
            directions: Vec::new(),
        }
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`ImportError`] names row, column and value.
    pub fn push(&mut self, row: &Row) -> Result<(), ImportError> {
        match &self.run {
            Some(run) if run.conditions == row.conditions => self.check_order(run, row)?,
            Some(run) => {
                check_set_point(&self.table, run, row)?;
                self.end_run(Some(row))?;
                self.begin_run(row)?;
            }
            None => self.begin_run(row)?,
        }
        self.take(row)
    }

    fn check_order(&self, run: &Run, row: &Row) -> Result<(), ImportError> {
        if row.time_ns <= run.last.time_ns {
            let (time_s, before_s) = (row.time_ns as f64 * 1e-9, run.last.time_ns as f64 * 1e-9);
            return Err(ImportError::Time { path: self.table.clone(), row: row.number, time_s, before_s });
        }
        if let (Some(now), Some(before)) = (row.angles_rad, run.last.angles_rad) {
            for (column, value_rad, before_rad) in
                [("theta1_rad", now[0], before[0]), ("theta2_rad", now[1], before[1])]
            {
                let step_rad = value_rad - before_rad;
                if step_rad.abs() > 0.5 * TAU {
                    let path = self.table.clone();
                    return Err(ImportError::Jump { path, row: row.number, column, value_rad, step_rad });
                }
            }
        }
        Ok(())
    }

    fn begin_run(&mut self, row: &Row) -> Result<(), ImportError> {
        let start_ns = row.time_ns.saturating_add(self.shift_ns);
        let Conditions { direction, load_nm, speed_rpm } = row.conditions;
        self.analysis.begin(RunConditions { direction, load_nm, speed_rpm });
        note(&mut self.loads_nm, load_nm);
        note(&mut self.speeds_rpm, speed_rpm);
        note(&mut self.directions, direction.as_str());
        self.run = Some(Run {
            conditions: row.conditions,
            first: *row,
            last: *row,
            travel_rad: None,
            start_ns,
            last_ns: start_ns,
            step_ns: 1,
            next_state_ns: start_ns,
            samples: 0,
            lost: 0,
        });
        Ok(())
    }

    /// Counts of an angle.
    fn counts(&self, row: &Row, column: &'static str, value_rad: f64) -> Result<i64, ImportError> {
        // θ = 2π · counts / counts per revolution, as the reader of the log turns it back.
        let counts = (value_rad * (self.counts_per_rev as f64 / TAU)).round();
        if counts.abs() > LARGEST_COUNT {
            let (path, counts_per_rev) = (self.table.clone(), self.counts_per_rev);
            return Err(ImportError::TooFar { path, row: row.number, column, value_rad, counts_per_rev });
        }
        Ok(counts as i64)
    }

    fn take(&mut self, row: &Row) -> Result<(), ImportError> {
        let time_ns = row.time_ns.saturating_add(self.shift_ns);
        let counted = match row.angles_rad {
            Some([theta1, theta2]) => {
                Some((self.counts(row, "theta1_rad", theta1)?, self.counts(row, "theta2_rad", theta2)?))
            }
            None => None,
        };
        // Begun by the caller, for this row or one before it.
        let Some(run) = &mut self.run else { return Ok(()) };
        if time_ns > run.last_ns {
            run.step_ns = time_ns - run.last_ns;
        }
        run.last = *row;
        run.last_ns = time_ns;
        let state_due = time_ns >= run.next_state_ns;
        if state_due {
            run.next_state_ns = time_ns + STATE_PERIOD_NS;
        }
        let conditions = run.conditions;
        match row.angles_rad {
            Some(angles) => {
                run.samples += 1;
                run.travel_rad = Some((run.travel_rad.map_or(angles, |(first, _)| first), angles));
            }
            None => run.lost += 1,
        }
        if state_due {
            self.state(time_ns, Phase::Record, conditions)?;
        }
        let number = self.sample;
        self.sample += 1;
        let (Some((input, output)), Some(angles)) = (counted, row.angles_rad) else {
            self.lost += 1;
            return Ok(());
        };
        self.samples += 1;
        if let Some(batch) = self.batch.push(number, time_ns, input, output) {
            self.write(&batch)?;
        }
        let logged = [self.scale.angle_rad(input), self.scale.angle_rad(output)];
        for (logged, given) in logged.iter().zip(angles) {
            self.largest_rounding_rad = self.largest_rounding_rad.max((logged - given).abs());
        }
        let Some(point) = self.analysis.push(logged[0], logged[1]) else { return Ok(()) };
        let message = proto::TransmissionError {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            direction: proto::Direction::from(conditions.direction).into(),
            revolution: point.revolution,
            theta1_rad: point.theta1_rad,
            theta2_rad: point.theta2_rad,
            te_rad: point.te_rad,
            model_te_rad: self.analysis.model().te_rad(point.theta1_rad, conditions.direction, conditions.load_nm),
            load_nm: conditions.load_nm,
            speed_rpm: conditions.speed_rpm,
        };
        Ok(self.writer.te(time_ns, time_ns, &message)?)
    }

    fn write(&mut self, batch: &proto::AngleBatch) -> Result<(), ImportError> {
        let arrived_ns = batch.last_time_ns().unwrap_or(batch.t0_ns);
        Ok(self.writer.angles(arrived_ns, batch.t0_ns, batch)?)
    }

    fn state(&mut self, time_ns: u64, phase: Phase, conditions: Conditions) -> Result<(), ImportError> {
        let Conditions { direction, load_nm, speed_rpm } = conditions;
        let state = RigState {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            phase: phase.into(),
            direction: proto::Direction::from(direction).into(),
            speed_setpoint_rpm: speed_rpm,
            speed_rpm,
            load_setpoint_nm: load_nm,
            load_nm,
            samples: self.samples,
            samples_lost: self.lost,
            ..RigState::default()
        };
        Ok(self.writer.state(time_ns, time_ns, &state)?)
    }

    /// Ends the run under way; `next` is the row that ends it.
    fn end_run(&mut self, next: Option<&Row>) -> Result<(), ImportError> {
        let Some(run) = self.run.take() else { return Ok(()) };
        if let Some((first, last)) = run.travel_rad {
            for (column, travel_rad) in [("theta1_rad", last[0] - first[0]), ("theta2_rad", last[1] - first[1])] {
                if travel_rad * run.conditions.direction.sign() < -CLEAR_TRAVEL_RAD {
                    return Err(ImportError::Sense {
                        path: self.table.clone(),
                        first_row: run.first.number,
                        last_row: run.last.number,
                        column,
                        travel_rad,
                        direction: run.conditions.direction,
                    });
                }
            }
        }
        if let Some(batch) = self.batch.take() {
            self.write(&batch)?;
        }
        // The run ends a step after its last sample, or where the next one begins.
        let mut end_ns = run.last_ns.saturating_add(run.step_ns);
        if let Some(next) = next {
            let next_ns = next.time_ns.saturating_add(self.shift_ns);
            if next_ns <= run.last_ns {
                let begins_ns = end_ns.saturating_add(PAUSE_NS);
                self.warnings.push(format!(
                    "{}, row {}: time_s starts anew with the run; its times were moved by {} s",
                    self.table.display(),
                    next.number,
                    (begins_ns - next.time_ns) as f64 * 1e-9
                ));
                self.shift_ns = begins_ns - next.time_ns;
            } else {
                end_ns = end_ns.min(next_ns);
            }
        }
        self.state(end_ns, Phase::Idle, run.conditions)?;
        let duration_s = (end_ns - run.start_ns) as f64 * 1e-9;
        let model = self.analysis.model().clone();
        let Some(backlash) = self.analysis.end(run.lost, duration_s) else { return Ok(()) };
        let grid = AngleGrid::default();
        for (bin, value) in backlash.curve.curve.values_rad.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let message = proto::Backlash {
                timestamp: Some(Timestamp::from_ns(end_ns)),
                theta1_rad: grid.centre(bin),
                backlash_rad: *value,
                model_backlash_rad: model.backlash_rad(grid.centre(bin), run.conditions.load_nm),
                load_nm: run.conditions.load_nm,
            };
            self.writer.backlash(end_ns, end_ns, &message)?;
        }
        Ok(())
    }

    /// Ends the log. `describe` completes what is known of it by then.
    ///
    /// # Errors
    /// [`ImportError`] when there was nothing, or the end cannot be written.
    pub fn finish(mut self, mut describe: RunMetadata) -> Result<Imported, ImportError> {
        let end_ns = self.run.as_ref().map_or(0, |run| run.last_ns.saturating_add(run.step_ns));
        self.end_run(None)?;
        if self.samples == 0 {
            return Err(ImportError::Empty { path: self.table });
        }
        describe.direction = self.directions.join(",");
        describe.load_nm = self.loads_nm;
        describe.speed_rpm = self.speeds_rpm;
        self.writer.event(end_ns, end_ns, Level::Info, "import", &describe.note)?;
        self.writer.run_metadata(&describe)?;
        self.writer.finish()?;
        Ok(Imported {
            analysis: self.analysis,
            lost: self.lost,
            largest_rounding_rad: self.largest_rounding_rad,
            warnings: self.warnings,
        })
    }
}

fn note<T: PartialEq>(list: &mut Vec<T>, value: T) {
    if !list.contains(&value) {
        list.push(value);
    }
}

/// A set-point that changes after a few rows is a reading.
fn check_set_point(table: &Path, run: &Run, row: &Row) -> Result<(), ImportError> {
    let (was, is) = (run.conditions, row.conditions);
    if was.direction != is.direction || run.samples + run.lost >= FEWEST_SAMPLES {
        return Ok(());
    }
    let (column, value, before, instead) = if was.load_nm == is.load_nm {
        ("speed_rpm", is.speed_rpm, was.speed_rpm, "--rpm 5")
    } else {
        ("load_nm", is.load_nm, was.load_nm, "--load 10Nm")
    };
    let samples = run.samples + run.lost;
    Err(ImportError::Reading { path: table.into(), row: row.number, column, value, before, samples, instead })
}
