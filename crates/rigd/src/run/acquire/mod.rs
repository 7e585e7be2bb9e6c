//! From the counter's batches to the log and to live TE: losses are counted, runs begin and end at exact samples.

mod counts;
mod encoders;
mod live_te;
mod recording;
mod status;
mod timestamps;
mod two_readers;

use std::f64::consts::TAU;

use gearmodel::measure::RunConditions;
use riglog::proto::{Level, Phase};
use wire::Samples;

pub use status::{Latest, Status};

use super::recorder::{Entry, Recorder};
use crate::analysis::Analysis;
use crate::clock::Clock;
use crate::device::{Clocks, CounterIdentity, DeviceError};
use crate::summary::TimeSkew;
use counts::Counts;
use encoders::Encoders;
use live_te::LiveTe;
use recording::RunState;
use timestamps::{Before, Dated, Timestamps};
use two_readers::TwoReaders;

/// The acquisition.
pub struct Acquisition {
    recorder: Recorder,
    clock: Clock,
    analysis: Analysis,
    timestamps: Timestamps,
    encoders: Encoders,
    readers: TwoReaders,
    counts: Counts,
    recording: RunState,
    live_te: LiveTe,
    /// Number after the last sample.
    next_sample: u64,
    samples: u64,
    lost: u64,
    recorded_samples: u64,
    previous_theta1_rad: Option<f64>,
    /// What the rig is doing.
    pub status: Status,
    /// Latest values.
    pub latest: Latest,
}

impl Acquisition {
    /// An acquisition that writes to `recorder` and analyses with `analysis`.
    #[must_use]
    pub fn new(recorder: Recorder, clock: Clock, analysis: Analysis) -> Self {
        Self {
            recorder,
            clock,
            analysis,
            timestamps: Timestamps::default(),
            encoders: Encoders::default(),
            readers: TwoReaders::default(),
            counts: Counts::default(),
            recording: RunState::Idle,
            live_te: LiveTe::default(),
            next_sample: 0,
            samples: 0,
            lost: 0,
            recorded_samples: 0,
            previous_theta1_rad: None,
            status: Status::default(),
            latest: Latest::default(),
        }
    }

    /// The encoders as the counter describes them; before the stream starts. Those of a counter that comes back must be the same.
    ///
    /// # Errors
    /// [`DeviceError::Unexpected`] for another counter or another encoder than the log was begun with.
    pub fn set_encoders(&mut self, identity: &CounterIdentity, signs: [i8; 2], port: &str) -> Result<(), DeviceError> {
        self.encoders.describe(identity, signs, port)
    }

    /// The discs are turned on their shafts by this, deg: their indices pass so much later than usual.
    pub fn set_mounting(&mut self, mounted_deg: [f64; 2]) {
        self.encoders.mount(mounted_deg);
    }

    /// The counter is lost: what it streams when it is back is numbered on after what is missing, and homed again.
    pub fn stream_lost(&mut self) {
        self.timestamps.restart();
        self.forget_index();
    }

    /// Goes on in another log; the encoders' metadata are written there too. Gives the log so far back, to be finalised.
    #[must_use]
    pub fn change_recorder(&mut self, recorder: Recorder) -> Recorder {
        let before = std::mem::replace(&mut self.recorder, recorder);
        if let Some(encoders) = self.encoders.written() {
            self.write_now(Entry::Encoders(encoders));
        }
        before
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

    /// The analysis so far, to drop what is not needed any more.
    pub fn analysis_mut(&mut self) -> &mut Analysis {
        &mut self.analysis
    }

    /// Samples numbered so far, lost ones included.
    #[must_use]
    pub fn samples_numbered(&self) -> u64 {
        self.next_sample
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
        self.write_now(Entry::Event(level, name, message));
    }

    fn write_now(&self, entry: Entry) {
        let now = self.clock.now_ns();
        self.recorder.write(now, now, entry);
    }

    /// What two readers' clocks are known to do now; within a run the least that was known of their skew counts.
    pub fn note_clocks(&mut self, clocks: Option<Clocks>) {
        self.readers.note(clocks, self.recording.is_active());
    }

    /// What two readers' clocks were worth in TE, at the worst of the runs so far.
    #[must_use]
    pub fn time_skew(&self) -> Option<TimeSkew> {
        self.readers.time_skew()
    }

    /// Whether the encoders' zero is an index that has to be looked for.
    #[must_use]
    pub fn has_index(&self) -> bool {
        self.encoders.has_index()
    }

    /// Both index pulses have been seen.
    #[must_use]
    pub fn index_seen(&self) -> bool {
        self.encoders.index_seen()
    }

    /// The encoder whose index has not been seen.
    #[must_use]
    pub fn missing_index(&self) -> Option<&'static str> {
        self.encoders.missing_index()
    }

    /// Forgets the index: one that passed before counts were lost is no zero.
    pub fn forget_index(&mut self) {
        self.encoders.forget_index();
    }

    /// Takes the index as zero of both angles and writes the encoders' metadata; from the second time on the index is checked
    /// against the first, and stays where the log says that it is.
    pub fn home(&mut self) {
        let Some(homed) = self.encoders.home(&self.analysis.model().pair) else { return };
        self.previous_theta1_rad = None;
        for (level, what) in homed.checks {
            self.event(level, "index check", what);
        }
        if let Some(encoders) = homed.metadata {
            self.write_now(Entry::Encoders(encoders));
        }
    }

    /// Takes the zero of encoders that have no index: once. What has lost it since cannot find it again, and `false` says so.
    #[must_use]
    pub fn home_without_index(&mut self) -> bool {
        let Some(what) = self.encoders.assume_index() else { return self.encoders.is_homed() };
        self.home();
        self.event(Level::Warning, "zero", what);
        true
    }

    /// Records `revolutions` whole turns from the next bin edge on.
    pub fn arm(&mut self, conditions: RunConditions, revolutions: f64) {
        self.live_te.begin(&mut self.latest);
        self.recording = RunState::Armed { conditions, revolutions };
    }

    /// The armed run is over.
    #[must_use]
    pub fn recorded(&self) -> bool {
        self.recording.is_done()
    }

    /// Revolutions of the run that is over.
    #[must_use]
    pub fn recorded_revolutions(&self) -> f64 {
        self.recording.revolutions()
    }

    /// Ends the active run at the end of the revolution that it is in; one that has not begun does not begin.
    pub fn end_with_revolution(&mut self) {
        self.recording.end_with_revolution(self.latest.revolutions);
    }

    /// Ends a run before its time: what was recorded stays, and the state says where it ends.
    pub fn abandon(&mut self) {
        if self.recording.is_active() {
            // Just past the last sample; the states that follow are dated alike, or they would end the run before it.
            self.latest.sample_ns += 1;
            self.end_run(self.latest.sample_ns, self.next_sample);
        }
        self.recording = RunState::Idle;
    }

    /// Writes `/rig/state`, dated by the latest sample.
    pub fn write_state(&self) {
        let now = self.clock.now_ns();
        let time = if self.latest.sample_ns == 0 { now } else { self.latest.sample_ns };
        self.write_state_at(now, time, self.next_sample);
    }

    fn write_state_at(&self, log_time_ns: u64, time_ns: u64, samples: u64) {
        let state = self.status.message(self.latest.speed_rpm, time_ns, samples, self.lost);
        self.recorder.write(log_time_ns, time_ns, Entry::State(state));
    }

    /// Takes a batch: decodes, counts losses, splits it where a run begins or ends, writes it, and feeds the analysis.
    pub fn take(&mut self, batch: &Samples) {
        let arrived = self.clock.now_ns();
        let count = batch.len();
        if count == 0 {
            return;
        }
        let before = Before { next_sample: self.next_sample, sample_ns: self.latest.sample_ns, any: self.samples > 0 };
        let Dated { first_ns, first_sample, restarted } = self.timestamps.date(batch, arrived, before);
        if restarted {
            self.previous_theta1_rad = None;
        }
        self.count_losses(first_sample);
        self.next_sample = first_sample + count as u64;
        self.samples += count as u64;
        self.encoders.latch(batch);
        self.counts.fill(batch, self.encoders.counts_offset());
        self.measure_speed(batch.dt_ns);
        self.latest.arrived_ns = arrived;

        let last = self.counts.last();
        let mut written = 0;
        if self.encoders.is_homed() && self.recording.is_on() {
            written = self.scan(batch, first_ns, first_sample, arrived);
        } else if self.encoders.is_homed() {
            self.previous_theta1_rad = Some(self.encoders.theta1_rad(last[0]));
        }
        self.write_part(batch, [first_ns, first_sample], arrived, written, count);
        self.encoders.stand_at(last);
        let angles_rad = self.encoders.angles_rad();
        self.latest.theta1_rad = angles_rad[0];
        self.latest.residual_rad = if self.encoders.is_homed() {
            live_te::residual_rad(self.analysis.model(), &self.status, angles_rad)
        } else {
            f64::NAN
        };
        self.latest.sample_ns = first_ns + (count as u64 - 1) * u64::from(batch.dt_ns);
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
        let inputs = &self.counts.inputs;
        let [first, .., last] = inputs[..] else { return };
        let Some(turns) = self.encoders.input_turns(last - first) else { return };
        let minutes = (inputs.len() - 1) as f64 * f64::from(dt_ns) / 60e9;
        self.latest.speed_rpm = turns / minutes;
    }

    /// Walks the samples of a run; returns how many of the batch have been written already.
    fn scan(&mut self, batch: &Samples, first_ns: u64, first_sample: u64, arrived: u64) -> usize {
        let mut written = 0;
        for index in 0..self.counts.len() {
            let theta1 = self.encoders.theta1_rad(self.counts.inputs[index]);
            let time_ns = first_ns + index as u64 * u64::from(batch.dt_ns);
            let number = first_sample + index as u64;
            match &self.recording {
                RunState::Armed { .. } => {
                    let edge = self.recording.begins_at(self.previous_theta1_rad, theta1);
                    self.previous_theta1_rad = Some(theta1);
                    let Some(edge_rad) = edge else { continue };
                    self.write_part(batch, [first_ns, first_sample], arrived, written, index);
                    written = index;
                    self.begin_run(edge_rad, time_ns, number, arrived);
                }
                RunState::Active { .. } if self.recording.ends_at(theta1) => {
                    self.write_part(batch, [first_ns, first_sample], arrived, written, index);
                    written = index;
                    self.end_run(time_ns, number);
                }
                RunState::Active { .. } => {}
                RunState::Idle | RunState::Done { .. } => break,
            }
            if let RunState::Active { edge_rad, .. } = self.recording {
                let theta2 = self.encoders.theta2_rad(self.counts.outputs[index]);
                let (analysis, status, latest) = (&mut self.analysis, &self.status, &mut self.latest);
                if let Some(te) = self.live_te.measure(analysis, status, latest, [theta1, theta2], time_ns) {
                    self.recorder.write(arrived, time_ns, Entry::Te(te));
                }
                self.latest.revolutions = (theta1 - edge_rad).abs() / TAU;
            }
        }
        written
    }

    fn begin_run(&mut self, edge_rad: f64, began_ns: u64, first_sample: u64, arrived: u64) {
        let RunState::Armed { conditions, revolutions } = self.recording else { return };
        self.recording = RunState::Active {
            edge_rad,
            extent_rad: revolutions * TAU,
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
        let RunState::Active { first_sample, began_ns, lost_before, extent_rad, .. } = self.recording else { return };
        let arrived = self.clock.now_ns();
        self.recording = RunState::Done { revolutions: (extent_rad / TAU).round() };
        self.status.phase = Phase::Approach;
        self.write_state_at(arrived, end_ns, end_sample);
        if let Some(clocks) = self.readers.book(&self.analysis.model().pair, self.status.speed_setpoint_rpm) {
            self.write_now(Entry::Metadata("rig.clocks", clocks));
        }
        let lost = self.lost - lost_before;
        self.recorded_samples += end_sample - first_sample - lost;
        let duration_s = (end_ns - began_ns) as f64 * 1e-9;
        if self.analysis.end(lost, duration_s).is_none() {
            return;
        }
        let Some(backlash) = self.analysis.backlash().last() else { return };
        for message in live_te::backlash_messages(self.analysis.model(), backlash, self.status.load_nm, end_ns) {
            self.recorder.write(arrived, end_ns, Entry::Backlash(message));
        }
    }

    /// Writes samples `from..to` of a batch as a message of their own.
    fn write_part(&self, batch: &Samples, first: [u64; 2], arrived: u64, from: usize, to: usize) {
        if let Some(part) = self.counts.part(batch, first, from, to) {
            self.recorder.write(arrived, part.t0_ns, Entry::Angles(part));
        }
    }
}
