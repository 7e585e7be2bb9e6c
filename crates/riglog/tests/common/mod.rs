//! Logs for tests: an elliptic pair turned ccw and cw at two loads, with every kind of record.

// Every test takes what it needs.
#![allow(dead_code)]

use std::{
    f64::consts::{PI, TAU},
    path::{Path, PathBuf},
};

use riglog::{
    BatchBuilder, EncoderMetadata, LogError, LogReader, LogStatistics, LogWriter, Record, RunMetadata, WriterOptions,
    proto::{Backlash, Direction, Level, Phase, RigState, Timestamp, TransmissionError},
};

/// Device time of the first sample.
pub const START_NS: u64 = 1_790_000_000_000_000_000;
/// Eccentricity of the pitch ellipse in [`PAIR_TOML`].
pub const K: f64 = 0.3287;
/// The pair of the log.
pub const PAIR_TOML: &str = "kind = \"elliptical\"\nmodule_mm = 3.0\nteeth = [47, 47]\neccentricity = 0.3287\n\
    pressure_angle_deg = 20.0\n\n[documented]\ne1_mm = 0.05\nphi1_rad = 0.3\n";
/// Angle bins of θ1 a turn.
const BINS: f64 = 720.0;

/// What a test log is made of.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Samples in a run.
    pub samples: u64,
    /// Samples before, between and after the runs.
    pub idle: u64,
    pub rate_hz: u64,
    /// Turns of the driver in a run.
    pub revolutions: f64,
    pub loads_nm: &'static [f64],
    /// Lose this many samples in the middle of the first run.
    pub lose: u64,
}

/// A log of some 30 kB.
pub const SMALL: Plan =
    Plan { samples: 1_500, idle: 120, rate_hz: 1_000, revolutions: 1.25, loads_nm: &[5.0, 10.0], lose: 0 };

/// Counts of 20 bits on the driver, and on the driven shaft a disc of another size, mounted backwards.
pub fn encoders() -> EncoderMetadata {
    EncoderMetadata {
        input_counts_per_rev: 1 << 20,
        output_counts_per_rev: 7_200_000,
        input_lines: 4_096,
        output_lines: 18_000,
        input_index_counts: 1_234,
        output_index_counts: -77,
        input_sign: 1,
        output_sign: -1,
    }
}

/// f(θ1) = θ1 + 2·atan(k sin θ1 / (1 − k cos θ1)): tan(θ2/2) = ((1+k)/(1−k)) tan(θ1/2), unwrapped.
pub fn f(theta1_rad: f64) -> f64 {
    theta1_rad + 2.0 * (K * theta1_rad.sin() / (1.0 - K * theta1_rad.cos())).atan()
}

pub fn options() -> WriterOptions {
    WriterOptions::new("riglog tests")
}

pub fn run_metadata() -> RunMetadata {
    RunMetadata {
        run_id: "5f0c0f7e-5b6b-4d0e-9a34-0d8f3a0b7f11".into(),
        started: "2026-11-02T09:30:00Z".into(),
        software: "riglog tests".into(),
        host: "bench".into(),
        backend: "sim".into(),
        operator: "nobody".into(),
        note: "umlauts äöü and \"quotes\"".into(),
        direction: "both".into(),
        load_nm: vec![5.0, 10.0],
        speed_rpm: vec![5.0],
        revolutions: Some(1.25),
    }
}

/// Writes the log of `plan` to `path`.
pub fn write(path: &Path, plan: &Plan) -> Result<LogStatistics, LogError> {
    let mut rig = Rig::new(LogWriter::create(path, options())?, plan);
    rig.log.run_metadata(&run_metadata())?;
    rig.log.attach(START_NS, "pair.toml", "application/toml", PAIR_TOML.as_bytes())?;
    rig.state(Phase::Homing, Direction::Unspecified, 0.0)?;
    rig.idle()?;
    rig.log.encoders(&encoders())?;
    for &load_nm in plan.loads_nm {
        for direction in [Direction::Ccw, Direction::Cw] {
            rig.state(Phase::Settle, direction, load_nm)?;
            rig.idle()?;
            rig.run(direction, load_nm)?;
        }
    }
    rig.idle()?;
    rig.log.sealed("0123456789abcdef")?;
    rig.log.finish()
}

struct Rig<'a> {
    log: LogWriter,
    plan: &'a Plan,
    batches: BatchBuilder,
    number: u64,
    theta1_rad: f64,
}

impl<'a> Rig<'a> {
    fn new(log: LogWriter, plan: &'a Plan) -> Self {
        Self { log, plan, batches: BatchBuilder::new(100), number: 0, theta1_rad: 0.2 }
    }

    fn now_ns(&self) -> u64 {
        START_NS + self.number * (1_000_000_000 / self.plan.rate_hz)
    }

    /// Log times run 3 ms behind the device.
    fn log_ns(&self) -> u64 {
        self.now_ns() + 3_000_000
    }

    fn state(&mut self, phase: Phase, direction: Direction, load_nm: f64) -> Result<(), LogError> {
        self.flush()?;
        let now_ns = self.now_ns();
        let state = RigState {
            timestamp: Some(Timestamp::from_ns(now_ns)),
            phase: phase.into(),
            direction: direction.into(),
            speed_setpoint_rpm: 5.0,
            speed_rpm: 5.01,
            load_setpoint_nm: load_nm,
            load_nm: load_nm * 1.003,
            brake_current_a: 0.21,
            brake_temperature_c: 31.5,
            servo_alarm: 0,
            samples: self.number,
            samples_lost: 0,
        };
        self.log.state(self.log_ns(), now_ns, &state)?;
        let text = format!("phase {}", phase.as_str_name());
        self.log.event(self.log_ns(), now_ns, Level::Info, "sequence", &text)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        let log_ns = self.log_ns();
        if let Some(batch) = self.batches.take() {
            self.log.angles(log_ns, batch.t0_ns, &batch)?;
        }
        Ok(())
    }

    /// Records a sample and returns the angles that its counts stand for.
    fn sample(&mut self) -> Result<(f64, f64), LogError> {
        let encoders = encoders();
        let te_rad = 4e-4 * (self.theta1_rad + 0.3).sin();
        let counts = |theta: f64, sign: i8, per_rev: u64, index: i64| {
            (theta * f64::from(sign) / TAU * per_rev as f64).round() as i64 + index
        };
        let e = &encoders;
        let input = counts(self.theta1_rad, e.input_sign, e.input_counts_per_rev, e.input_index_counts);
        let output = counts(f(self.theta1_rad) + te_rad, e.output_sign, e.output_counts_per_rev, e.output_index_counts);
        let log_ns = self.log_ns();
        if let Some(batch) = self.batches.push(self.number, self.now_ns(), input, output) {
            self.log.angles(log_ns, batch.t0_ns, &batch)?;
        }
        self.number += 1;
        Ok((encoders.theta1().angle_rad(input), encoders.theta2().angle_rad(output)))
    }

    fn idle(&mut self) -> Result<(), LogError> {
        for _ in 0..self.plan.idle {
            self.sample()?;
        }
        Ok(())
    }

    fn run(&mut self, direction: Direction, load_nm: f64) -> Result<(), LogError> {
        self.state(Phase::Record, direction, load_nm)?;
        let sense = if direction == Direction::Ccw { 1.0 } else { -1.0 };
        let step_rad = sense * TAU * self.plan.revolutions / self.plan.samples as f64;
        let (mut first_bin, mut furthest) = (None, -1);
        for n in 0..self.plan.samples {
            if n == self.plan.samples / 2 && load_nm == self.plan.loads_nm[0] && sense > 0.0 {
                self.number += self.plan.lose;
            }
            let at_ns = self.now_ns();
            let (theta1_rad, theta2_rad) = self.sample()?;
            self.theta1_rad += step_rad;
            // The first raw sample past the edge of a bin that the run had not reached.
            let bin = (theta1_rad * (BINS / TAU)).floor() as i64;
            let travelled = (bin - *first_bin.get_or_insert(bin)) * sense as i64;
            if travelled <= furthest {
                continue;
            }
            furthest = travelled;
            let te = TransmissionError {
                timestamp: Some(Timestamp::from_ns(at_ns)),
                direction: direction.into(),
                revolution: (travelled / BINS as i64) as i32,
                theta1_rad,
                theta2_rad,
                te_rad: theta2_rad - f(theta1_rad),
                model_te_rad: 0.0,
                load_nm,
                speed_rpm: 5.0,
            };
            self.log.te(self.log_ns(), at_ns, &te)?;
        }
        self.state(Phase::Stopping, direction, load_nm)?;
        if direction == Direction::Cw {
            for bin in 0..4 {
                let backlash = Backlash {
                    timestamp: Some(Timestamp::from_ns(self.now_ns())),
                    theta1_rad: (f64::from(bin) + 0.5) * PI / 360.0,
                    backlash_rad: 1e-5,
                    model_backlash_rad: 1.1e-5,
                    load_nm,
                };
                self.log.backlash(self.log_ns(), self.now_ns(), &backlash)?;
            }
        }
        Ok(())
    }
}

/// Every record of a log, and whether it is whole.
pub fn read(path: &Path) -> (Vec<Record>, riglog::Completeness) {
    let mut reader = LogReader::open(path).unwrap();
    let records: Vec<_> = reader.by_ref().collect::<Result<_, _>>().unwrap();
    let completeness = reader.completeness().unwrap().clone();
    (records, completeness)
}

/// The number of messages among records.
pub fn messages(records: &[Record]) -> u64 {
    let is_message = |record: &&Record| {
        matches!(
            record,
            Record::Angles { .. }
                | Record::State { .. }
                | Record::Te { .. }
                | Record::Backlash { .. }
                | Record::Event { .. }
                | Record::Unknown { .. }
        )
    };
    records.iter().filter(is_message).count() as u64
}

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
