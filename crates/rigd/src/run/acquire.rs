//! From the counter's batches to the log and to live TE: losses are counted, runs begin and end at exact samples.

mod two_readers;

use gearmodel::Direction;
use gearmodel::measure::{AngleGrid, RunConditions};
use riglog::proto::Level;
use riglog::proto::{self, AngleBatch, Phase, RigState, Timestamp};
use riglog::{AngleScale, EncoderMetadata};
use wire::counter_box::{SampleFlags, Samples};

use super::recorder::{Entry, Recorder};
use two_readers::TwoReaders;

use crate::analysis::Analysis;
use crate::clock::Clock;
use crate::device::{CounterIdentity, DeviceError};

/// An index that comes back further off than this part of a line is not the same index: counts were lost, or a disc has slipped.
const INDEX_TOLERANCE_LINES: f64 = 0.25;

/// What the sequencer knows of the rig; written to `/rig/state`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Status {
    /// Where the run is.
    pub phase: Phase,
    /// Sense of the run.
    pub direction: Option<Direction>,
    /// Speed that was asked for, rpm of the driver.
    pub speed_setpoint_rpm: f64,
    /// Load that was asked for, N·m at the driven gear.
    pub load_setpoint_nm: f64,
    /// Load by the brake's calibrated curve, N·m.
    pub load_nm: f64,
    /// Coil current, A.
    pub brake_current_a: f64,
    /// Temperature, °C.
    pub brake_temperature_c: f64,
    /// The drive's alarm.
    pub servo_alarm: u16,
}

/// The state of recording a run.
enum Recording {
    Idle,
    /// Begins at the next bin edge.
    Armed {
        conditions: RunConditions,
        revolutions: f64,
    },
    /// Ends when θ1 has gone `extent_rad` from the edge where it began.
    Active {
        edge_rad: f64,
        extent_rad: f64,
        sense: f64,
        first_sample: u64,
        began_ns: u64,
        lost_before: u64,
    },
    Done {
        revolutions: f64,
    },
}

/// Latest values, for the progress line and the supervisor.
#[derive(Debug, Clone, Copy, Default)]
pub struct Latest {
    /// Host time of the last batch, ns since the Unix epoch.
    pub arrived_ns: u64,
    /// Device time of the last sample, ns since the Unix epoch.
    pub sample_ns: u64,
    /// Driver speed from the encoder over the last batch, rpm, + = ccw.
    pub speed_rpm: f64,
    /// θ1, rad, from the index once homed, else from the start.
    pub theta1_rad: f64,
    /// Latest TE, rad.
    pub te_rad: f64,
    /// Smallest and largest TE of the active run, rad.
    pub te_range_rad: [f64; 2],
    /// Latest backlash, rad; once the other sense has been recorded at this load.
    pub backlash_rad: Option<f64>,
    /// Revolutions of the active run.
    pub revolutions: f64,
    /// TE less the model's at the last sample, rad; NaN unless the rig settles.
    pub residual_rad: f64,
    /// Largest |TE − model − zero| of the active run, rad: polls are rarer than batches, and none may be missed.
    pub excursion_rad: f64,
}

/// The acquisition.
pub struct Acquisition {
    recorder: Recorder,
    clock: Clock,
    analysis: Analysis,
    encoders: EncoderMetadata,
    theta1: AngleScale,
    theta2: AngleScale,
    homed: bool,
    /// The encoders' metadata are in the log, so that the index has to stay at the counts that they say.
    zero_written: bool,
    /// Unix time minus device time, ns.
    device_offset_ns: Option<i128>,
    /// Running number in the log minus the counter's own.
    number_offset: u64,
    /// Logged counts minus the counter's own.
    counts_offset: [i64; 2],
    /// The counter begins anew: it numbers its samples from 0, and may count from anywhere.
    restarts: bool,
    next_sample: u64,
    samples: u64,
    lost: u64,
    recorded_samples: u64,
    recording: Recording,
    previous_theta1_rad: Option<f64>,
    te_zero_rad: Option<f64>,
    /// Index latches: seen, and the counter value there.
    index_counts: [Option<i64>; 2],
    /// How far each disc is turned on its shaft, deg.
    mounted_deg: [f64; 2],
    /// Zero and clocks of encoders that two readers read.
    readers: TwoReaders,
    /// Last counts.
    counts: [i64; 2],
    /// What the rig is doing.
    pub status: Status,
    /// Latest values.
    pub latest: Latest,
    inputs: Vec<i64>,
    outputs: Vec<i64>,
}

impl Acquisition {
    /// An acquisition that writes to `recorder` and analyses with `analysis`.
    #[must_use]
    pub fn new(recorder: Recorder, clock: Clock, analysis: Analysis) -> Self {
        // Counts as they come until the counter box has said what they are.
        let encoders = EncoderMetadata {
            input_counts_per_rev: 1,
            output_counts_per_rev: 1,
            input_lines: 1,
            output_lines: 1,
            input_index_counts: 0,
            output_index_counts: 0,
            input_sign: 1,
            output_sign: 1,
        };
        Self {
            recorder,
            clock,
            analysis,
            theta1: encoders.theta1(),
            theta2: encoders.theta2(),
            encoders,
            homed: false,
            zero_written: false,
            device_offset_ns: None,
            number_offset: 0,
            counts_offset: [0; 2],
            restarts: false,
            next_sample: 0,
            samples: 0,
            lost: 0,
            recorded_samples: 0,
            recording: Recording::Idle,
            previous_theta1_rad: None,
            te_zero_rad: None,
            index_counts: [None; 2],
            mounted_deg: [0.0; 2],
            readers: TwoReaders::default(),
            counts: [0; 2],
            status: Status::default(),
            latest: Latest::default(),
            inputs: Vec::new(),
            outputs: Vec::new(),
        }
    }

    /// The encoders as the counter describes them; before the stream starts. Those of a counter that comes back must be the same.
    ///
    /// # Errors
    /// [`DeviceError::Unexpected`] for another counter or another encoder than the log was begun with.
    pub fn set_encoders(&mut self, identity: &CounterIdentity, signs: [i8; 2], port: &str) -> Result<(), DeviceError> {
        if self.zero_written {
            let known = [self.encoders.input_counts_per_rev, self.encoders.output_counts_per_rev];
            if known == identity.counts_per_rev {
                return Ok(());
            }
            return Err(DeviceError::Unexpected {
                device: "counter",
                port: port.to_owned(),
                found: format!("{:?} counts a revolution", identity.counts_per_rev),
                expected: format!("{known:?}, as when the log was begun (begin a new one for other encoders)"),
            });
        }
        self.readers.zero = identity.zero;
        self.encoders = EncoderMetadata {
            input_counts_per_rev: identity.counts_per_rev[0],
            output_counts_per_rev: identity.counts_per_rev[1],
            input_lines: u64::from(identity.lines[0]),
            output_lines: u64::from(identity.lines[1]),
            input_index_counts: 0,
            output_index_counts: 0,
            input_sign: signs[0],
            output_sign: signs[1],
        };
        self.rescale();
        Ok(())
    }

    /// The counter is lost: what it streams when it is back is numbered on after what is missing, and homed again.
    pub fn stream_lost(&mut self) {
        self.restarts = true;
        self.forget_index();
    }

    /// Samples numbered so far, lost ones included.
    #[must_use]
    pub fn samples_numbered(&self) -> u64 {
        self.next_sample
    }

    /// Goes on in another log; the encoders' metadata are written there too. Gives the log so far back, to be finalised.
    #[must_use]
    pub fn change_recorder(&mut self, recorder: Recorder) -> Recorder {
        let before = std::mem::replace(&mut self.recorder, recorder);
        if self.zero_written {
            let now = self.clock.now_ns();
            self.recorder.write(now, now, Entry::Encoders(self.encoders));
        }
        before
    }

    /// The analysis so far, to drop what is not needed any more.
    pub fn analysis_mut(&mut self) -> &mut Analysis {
        &mut self.analysis
    }

    /// The discs are turned on their shafts by this, deg: their indices pass so much later than usual.
    pub fn set_mounting(&mut self, mounted_deg: [f64; 2]) {
        self.mounted_deg = mounted_deg;
    }

    /// Latched counts of an index as they would be with the disc in its usual place.
    ///
    /// A disc turned by φ passes its index where the shaft stands at φ, so that θ = sign · 2π · (counts − index) / n + φ.
    fn usual_index(&self, which: usize, latched: i64) -> i64 {
        let (sign, counts_per_rev) = match which {
            0 => (self.encoders.input_sign, self.encoders.input_counts_per_rev),
            _ => (self.encoders.output_sign, self.encoders.output_counts_per_rev),
        };
        latched - (f64::from(sign) * self.mounted_deg[which] / 360.0 * counts_per_rev as f64).round() as i64
    }

    fn rescale(&mut self) {
        self.theta1 = self.encoders.theta1();
        self.theta2 = self.encoders.theta2();
    }

    /// The recorder.
    #[must_use]
    pub fn recorder(&self) -> &Recorder {
        &self.recorder
    }

    /// The analysis so far.
    #[must_use]
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Samples that arrived since the stream began.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples that never arrived.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Samples of finished runs.
    #[must_use]
    pub fn recorded_samples(&self) -> u64 {
        self.recorded_samples
    }

    /// Gives recorder and analysis back, for the end.
    #[must_use]
    pub fn into_parts(self) -> (Recorder, Analysis) {
        (self.recorder, self.analysis)
    }

    /// Writes an event to the log.
    pub fn event(&self, level: Level, name: &'static str, message: String) {
        let now = self.clock.now_ns();
        self.recorder.write(now, now, Entry::Event(level, name, message));
    }

    /// Both index pulses have been seen.
    #[must_use]
    pub fn index_seen(&self) -> bool {
        self.index_counts.iter().all(Option::is_some)
    }

    /// The encoder whose index has not been seen.
    #[must_use]
    pub fn missing_index(&self) -> Option<&'static str> {
        ["input", "output"]
            .into_iter()
            .zip(self.index_counts)
            .find(|(_, latched)| latched.is_none())
            .map(|(which, _)| which)
    }

    /// Forgets the index: one that passed before counts were lost is no zero.
    pub fn forget_index(&mut self) {
        self.index_counts = [None; 2];
        self.homed = false;
    }

    /// Takes the index as zero of both angles and writes the encoders' metadata; from the second time on the index is checked
    /// against the first, and stays where the log says that it is.
    ///
    /// The driven gear's index repeats every turn; the turn is taken that puts TE within half a turn of zero.
    pub fn home(&mut self) {
        let [Some(input), Some(output)] = self.index_counts else { return };
        let [input, output] = [self.usual_index(0, input), self.usual_index(1, output)];
        if self.zero_written {
            self.check_index([input, output]);
        } else {
            self.encoders.input_index_counts = input;
            self.encoders.output_index_counts = output;
        }
        self.rescale();
        let theta1 = self.theta1.angle_rad(self.counts[0]);
        let theta2 = self.theta2.angle_rad(self.counts[1]);
        let turns = ((theta2 - self.analysis.model().pair.theta2(theta1)) / std::f64::consts::TAU).round() as i64;
        let turned = turns * i64::from(self.encoders.output_sign) * self.encoders.output_counts_per_rev as i64;
        self.homed = true;
        self.previous_theta1_rad = None;
        if self.zero_written {
            self.shift(1, -turned);
            return;
        }
        self.encoders.output_index_counts += turned;
        self.rescale();
        self.zero_written = true;
        let now = self.clock.now_ns();
        self.recorder.write(now, now, Entry::Encoders(self.encoders));
    }

    /// Where the indices are now against where the log says: within a fraction of a line the zero stays as it was; anything else
    /// moves the counts, so that the index stays at its counts and the angles keep their meaning.
    fn check_index(&mut self, latched: [i64; 2]) {
        let encoders = self.encoders;
        let known = [
            (encoders.input_index_counts, encoders.input_counts_per_rev, encoders.input_lines),
            (encoders.output_index_counts, encoders.output_counts_per_rev, encoders.output_lines),
        ];
        for (which, (name, (index, per_rev, lines))) in ["input", "output"].into_iter().zip(known).enumerate() {
            let off = (latched[which] - index).rem_euclid(per_rev as i64);
            let off = if off > per_rev as i64 / 2 { off - per_rev as i64 } else { off };
            let tolerance = INDEX_TOLERANCE_LINES * per_rev as f64 / lines.max(1) as f64;
            let arcsec = off as f64 / per_rev as f64 * 1_296_000.0;
            if off.unsigned_abs() as f64 <= tolerance {
                let what = format!("{name} encoder: index at its place, {off} counts ({arcsec:.2} arcsec) off");
                self.event(Level::Info, "index check", what);
                continue;
            }
            self.shift(which, -off);
            let what = format!(
                "{name} encoder: index {off} counts ({arcsec:.1} arcsec) off; the counts are moved so that it stays at its place (the counter began anew, counts were lost, or the disc has slipped)"
            );
            self.event(Level::Warning, "index check", what);
        }
    }

    /// Moves an encoder's logged counts from here on.
    fn shift(&mut self, which: usize, by: i64) {
        self.counts_offset[which] += by;
        self.counts[which] += by;
        self.index_counts[which] = self.index_counts[which].map(|counts| counts + by);
    }

    /// Records `revolutions` whole turns from the next bin edge on.
    pub fn arm(&mut self, conditions: RunConditions, revolutions: f64) {
        self.latest.te_range_rad = [f64::INFINITY, f64::NEG_INFINITY];
        self.latest.excursion_rad = 0.0;
        self.te_zero_rad = None;
        self.recording = Recording::Armed { conditions, revolutions };
    }

    /// The armed run is over.
    #[must_use]
    pub fn recorded(&self) -> bool {
        matches!(self.recording, Recording::Done { .. })
    }

    /// Revolutions of the run that is over.
    #[must_use]
    pub fn recorded_revolutions(&self) -> f64 {
        match self.recording {
            Recording::Done { revolutions } => revolutions,
            _ => 0.0,
        }
    }

    /// Ends the active run at the end of the revolution that it is in; one that has not begun does not begin.
    pub fn end_with_revolution(&mut self) {
        let under_way = (self.latest.revolutions + 1e-9).ceil().max(1.0) * std::f64::consts::TAU;
        match &mut self.recording {
            Recording::Active { extent_rad, .. } => *extent_rad = extent_rad.min(under_way),
            Recording::Armed { .. } => self.recording = Recording::Done { revolutions: 0.0 },
            Recording::Idle | Recording::Done { .. } => {}
        }
    }

    /// Ends a run before its time: what was recorded stays, and the state says where it ends.
    pub fn abandon(&mut self) {
        if matches!(self.recording, Recording::Active { .. }) {
            // Just past the last sample; the states that follow are dated alike, or they would end the run before it.
            self.latest.sample_ns += 1;
            self.end_run(self.latest.sample_ns, self.next_sample);
        }
        self.recording = Recording::Idle;
    }

    /// Writes `/rig/state`, dated by the latest sample.
    pub fn write_state(&self) {
        let now = self.clock.now_ns();
        let time = if self.latest.sample_ns == 0 { now } else { self.latest.sample_ns };
        self.write_state_at(now, time, self.next_sample);
    }

    fn write_state_at(&self, log_time_ns: u64, time_ns: u64, samples: u64) {
        let status = &self.status;
        let state = RigState {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            phase: status.phase.into(),
            direction: status.direction.map_or(proto::Direction::Unspecified, proto::Direction::from).into(),
            speed_setpoint_rpm: status.speed_setpoint_rpm,
            speed_rpm: self.latest.speed_rpm,
            load_setpoint_nm: status.load_setpoint_nm,
            load_nm: status.load_nm,
            brake_current_a: status.brake_current_a,
            brake_temperature_c: status.brake_temperature_c,
            servo_alarm: u32::from(status.servo_alarm),
            samples,
            samples_lost: self.lost,
        };
        self.recorder.write(log_time_ns, time_ns, Entry::State(state));
    }

    /// Takes a batch: decodes, counts losses, splits it where a run begins or ends, writes it, and feeds the analysis.
    pub fn take(&mut self, batch: &Samples) {
        let arrived = self.clock.now_ns();
        let count = batch.input_delta.len();
        if count == 0 {
            return;
        }
        let first_ns = self.date(batch, arrived);
        let first_sample = batch.first_sample.wrapping_add(self.number_offset);
        self.count_losses(first_sample);
        self.next_sample = first_sample + count as u64;
        self.samples += count as u64;
        for (latched, seen, counts) in [
            (0, batch.flags.has(SampleFlags::INPUT_INDEX), batch.input_index_counts),
            (1, batch.flags.has(SampleFlags::OUTPUT_INDEX), batch.output_index_counts),
        ] {
            if seen {
                self.index_counts[latched] = Some(counts.wrapping_add(self.counts_offset[latched]));
            }
        }
        let [input_offset, output_offset] = self.counts_offset;
        accumulate(batch.input_base.wrapping_add(input_offset), &batch.input_delta, &mut self.inputs);
        accumulate(batch.output_base.wrapping_add(output_offset), &batch.output_delta, &mut self.outputs);
        self.measure_speed(batch.dt_ns);
        self.latest.arrived_ns = arrived;

        let mut written = 0;
        if self.homed && !matches!(self.recording, Recording::Idle | Recording::Done { .. }) {
            written = self.scan(batch, first_ns, first_sample, arrived);
        } else if self.homed {
            self.previous_theta1_rad = Some(self.theta1.angle_rad(self.inputs[count - 1]));
        }
        self.write_part(batch, [first_ns, first_sample], arrived, written, count);
        self.counts = [self.inputs[count - 1], self.outputs[count - 1]];
        self.latest.theta1_rad = self.theta1.angle_rad(self.counts[0]);
        self.latest.residual_rad = self.residual_rad();
        self.latest.sample_ns = first_ns + (count as u64 - 1) * u64::from(batch.dt_ns);
    }

    /// Unix time of a batch's first sample, ns. A counter that begins anew is dated and numbered anew: by when its first batch
    /// arrives, after the samples that are missing meanwhile.
    fn date(&mut self, batch: &Samples, arrived: u64) -> u64 {
        let count = batch.input_delta.len() as u64;
        let last_device_ns = batch.device_time_ns + (count - 1) * u64::from(batch.dt_ns);
        let offset_now = i128::from(arrived) - i128::from(last_device_ns);
        if std::mem::take(&mut self.restarts) {
            self.device_offset_ns = None;
            self.previous_theta1_rad = None;
            // Nothing was sent before the first sample that there ever was.
            let first_ns = (i128::from(batch.device_time_ns) + offset_now).max(0) as u64;
            let dt_ns = u64::from(batch.dt_ns.max(1));
            // To the nearest: the end of an abandoned run lies a nanosecond past its last sample.
            let since_ns = first_ns.saturating_sub(self.latest.sample_ns);
            let periods = if self.samples == 0 { 1 } else { (since_ns + dt_ns / 2) / dt_ns };
            let number = self.next_sample + periods.max(1) - 1;
            self.number_offset = number.wrapping_sub(batch.first_sample);
        }
        let offset = *self.device_offset_ns.get_or_insert(offset_now);
        (i128::from(batch.device_time_ns) + offset) as u64
    }

    /// TE less the model's at the last sample: what settling is judged by.
    fn residual_rad(&self) -> f64 {
        if !self.homed || self.status.phase != Phase::Settle {
            return f64::NAN;
        }
        let (theta1, theta2) = (self.theta1.angle_rad(self.counts[0]), self.theta2.angle_rad(self.counts[1]));
        let model = self.analysis.model();
        let direction = self.status.direction.unwrap_or(Direction::Ccw);
        theta2 - model.pair.theta2(theta1) - model.te_rad(theta1, direction, self.status.load_setpoint_nm)
    }

    fn count_losses(&mut self, first_sample: u64) {
        if first_sample > self.next_sample {
            let lost = first_sample - self.next_sample;
            self.lost += lost;
            self.event(
                Level::Warning,
                "loss",
                format!("samples {} to {} never arrived ({lost} lost)", self.next_sample, first_sample - 1),
            );
        }
    }

    fn measure_speed(&mut self, dt_ns: u32) {
        let count = self.inputs.len();
        if count < 2 || self.encoders.input_counts_per_rev == 0 {
            return;
        }
        let turns = (self.inputs[count - 1] - self.inputs[0]) as f64 * f64::from(self.encoders.input_sign)
            / self.encoders.input_counts_per_rev as f64;
        let minutes = (count - 1) as f64 * f64::from(dt_ns) / 60e9;
        self.latest.speed_rpm = turns / minutes;
    }

    /// Walks the samples of a run; returns how many of the batch have been written already.
    fn scan(&mut self, batch: &Samples, first_ns: u64, number: u64, arrived: u64) -> usize {
        let grid = AngleGrid::default();
        let mut written = 0;
        for index in 0..self.inputs.len() {
            let theta1 = self.theta1.angle_rad(self.inputs[index]);
            match &self.recording {
                Recording::Armed { conditions, .. } => {
                    let direction = conditions.direction;
                    let edge =
                        self.previous_theta1_rad.and_then(|previous| edge_between(grid, previous, theta1, direction));
                    self.previous_theta1_rad = Some(theta1);
                    let Some(edge_rad) = edge else { continue };
                    self.write_part(batch, [first_ns, number], arrived, written, index);
                    written = index;
                    self.begin_run(
                        edge_rad,
                        first_ns + index as u64 * u64::from(batch.dt_ns),
                        number + index as u64,
                        arrived,
                    );
                }
                Recording::Active { edge_rad, extent_rad, sense, .. } => {
                    if (theta1 - edge_rad) * sense >= *extent_rad {
                        self.write_part(batch, [first_ns, number], arrived, written, index);
                        written = index;
                        let end_ns = first_ns + index as u64 * u64::from(batch.dt_ns);
                        self.end_run(end_ns, number + index as u64);
                    }
                }
                Recording::Idle | Recording::Done { .. } => break,
            }
            if let Recording::Active { edge_rad, .. } = self.recording {
                let theta2 = self.theta2.angle_rad(self.outputs[index]);
                let time_ns = first_ns + index as u64 * u64::from(batch.dt_ns);
                self.measure(theta1, theta2, time_ns, arrived);
                self.latest.revolutions = (theta1 - edge_rad).abs() / std::f64::consts::TAU;
            }
        }
        written
    }

    fn measure(&mut self, theta1: f64, theta2: f64, time_ns: u64, arrived: u64) {
        let Some(point) = self.analysis.push(theta1, theta2) else { return };
        let direction = self.status.direction.unwrap_or(Direction::Ccw);
        let model = self.analysis.model().te_rad(point.theta1_rad, direction, self.status.load_setpoint_nm);
        let zero = *self.te_zero_rad.get_or_insert(point.te_rad - model);
        let latest = &mut self.latest;
        latest.backlash_rad = self.analysis.live_backlash_rad(&point);
        latest.te_rad = point.te_rad;
        latest.te_range_rad = [latest.te_range_rad[0].min(point.te_rad), latest.te_range_rad[1].max(point.te_rad)];
        latest.excursion_rad = latest.excursion_rad.max((point.te_rad - model - zero).abs());
        let message = proto::TransmissionError {
            timestamp: Some(Timestamp::from_ns(time_ns)),
            direction: proto::Direction::from(direction).into(),
            revolution: point.revolution,
            theta1_rad: point.theta1_rad,
            theta2_rad: point.theta2_rad,
            te_rad: point.te_rad,
            model_te_rad: model,
            load_nm: self.status.load_nm,
            speed_rpm: latest.speed_rpm,
        };
        self.recorder.write(arrived, time_ns, Entry::Te(message));
    }

    fn begin_run(&mut self, edge_rad: f64, began_ns: u64, first_sample: u64, arrived: u64) {
        let Recording::Armed { conditions, revolutions } = self.recording else { return };
        self.recording = Recording::Active {
            edge_rad,
            extent_rad: revolutions * std::f64::consts::TAU,
            sense: conditions.direction.sign(),
            first_sample,
            began_ns,
            lost_before: self.lost,
        };
        self.status.phase = Phase::Record;
        self.analysis.begin(conditions);
        self.write_state_at(arrived, began_ns, first_sample);
    }

    fn end_run(&mut self, end_ns: u64, end_sample: u64) {
        let Recording::Active { first_sample, began_ns, lost_before, extent_rad, .. } = self.recording else { return };
        let arrived = self.clock.now_ns();
        self.recording = Recording::Done { revolutions: (extent_rad / std::f64::consts::TAU).round() };
        self.status.phase = Phase::Approach;
        self.write_state_at(arrived, end_ns, end_sample);
        self.book_clocks();
        let lost = self.lost - lost_before;
        self.recorded_samples += end_sample - first_sample - lost;
        let duration_s = (end_ns - began_ns) as f64 * 1e-9;
        let grid = AngleGrid::default();
        let load_nm = self.status.load_nm;
        let model = self.analysis.model().clone();
        let Some(backlash) = self.analysis.end(lost, duration_s) else { return };
        for (bin, value) in backlash.curve.curve.values_rad.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let message = proto::Backlash {
                timestamp: Some(Timestamp::from_ns(end_ns)),
                theta1_rad: grid.centre(bin),
                backlash_rad: *value,
                model_backlash_rad: model.backlash_rad(grid.centre(bin), backlash.conditions.load_nm),
                load_nm,
            };
            self.recorder.write(arrived, end_ns, Entry::Backlash(message));
        }
    }

    /// Writes samples `from..to` of a batch as a message of their own.
    fn write_part(&self, batch: &Samples, [first_ns, number]: [u64; 2], arrived: u64, from: usize, to: usize) {
        if from == to {
            return;
        }
        let deltas = |all: &[i32]| {
            let mut part = all[from..to].to_vec();
            part[0] = 0;
            part
        };
        let t0_ns = first_ns + from as u64 * u64::from(batch.dt_ns);
        let message = AngleBatch {
            t0_ns,
            dt_ns: batch.dt_ns,
            first_sample: number + from as u64,
            input_base: self.inputs[from],
            output_base: self.outputs[from],
            input_delta: deltas(&batch.input_delta),
            output_delta: deltas(&batch.output_delta),
        };
        self.recorder.write(arrived, t0_ns, Entry::Angles(message));
    }
}

/// The bin edge that θ1 passed from `previous` to `theta1` in the sense of `direction`, rad; `None` if it passed none.
fn edge_between(grid: AngleGrid, previous: f64, theta1: f64, direction: Direction) -> Option<f64> {
    let width = std::f64::consts::TAU / grid.bins() as f64;
    let edge = match direction {
        Direction::Ccw => (theta1 / width).floor() * width,
        Direction::Cw => (theta1 / width).ceil() * width,
    };
    ((edge - previous) * direction.sign() > 0.0).then_some(edge)
}

/// Counts from a base and the steps between samples; the first step is 0.
fn accumulate(base: i64, deltas: &[i32], counts: &mut Vec<i64>) {
    counts.clear();
    let mut value = base;
    counts.extend(deltas.iter().map(|delta| {
        value += i64::from(*delta);
        value
    }));
}
