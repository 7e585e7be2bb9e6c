//! The plant and its devices on one clock: whoever touches a device first brings the plant up to now.

use std::time::Duration;

use tokio::sync::watch;
use tokio::time::Instant;
use wire::modbus::Request;
use wire::rd60xx::Model;

use super::emulator::{
    BrakeCoil, BrakeEmulator, CounterEmulator, EncoderPair, Latched, QsbClock, QsbEmulator, Reply, ServoAxis,
    ServoEmulator,
};
use super::plant::{Plant, PlantError, PlantSpec, Truth};
use super::shaft_record::ShaftRecord;
use wire::DeviceKind;

/// Sampling of the plant while the counter box does not ask for any, Hz.
pub const IDLE_RATE_HZ: f64 = 10_000.0;

/// Input terminal of the emergency stop, as the drive is commissioned.
const EMERGENCY_STOP_INPUT: u8 = 8;

/// How often the counter box looks whether a frame is full.
const FRAME_PERIOD: Duration = Duration::from_millis(10);

/// Longest time that is caught up in one go: a process that was suspended does not replay hours.
const LONGEST_CATCH_UP_NS: u64 = 2_000_000_000;

/// The simulated rig.
pub struct SimulatedRig {
    plant: Plant,
    servo: ServoEmulator,
    brake: BrakeEmulator,
    counter: CounterEmulator,
    readers: Option<[QsbEmulator; 2]>,
    start: Instant,
    period_ns: u64,
    time_ns: u64,
    stream: Vec<u8>,
    plugs: [Plug; 3],
    record: Option<ShaftRecord>,
    /// Plant counts at which the counter box began to count, and the indices that had passed before.
    counts_from: [i64; 2],
    passed_before: [Option<i64>; 2],
    plant_counts: [i64; 2],
}

/// A device's plug: pulled, and told to whoever serves its line.
struct Plug {
    out: bool,
    told: watch::Sender<()>,
}

impl Default for Plug {
    fn default() -> Self {
        Self { out: false, told: watch::channel(()).0 }
    }
}

impl SimulatedRig {
    /// A rig at rest.
    ///
    /// # Errors
    /// [`PlantError`] when the plant cannot be built.
    pub fn new(spec: &PlantSpec, rate_hz: f64, seed: u64) -> Result<Self, PlantError> {
        let plant = Plant::new(spec, rate_hz, seed)?;
        let counter = CounterEmulator::new("SIM-0001", &plant);
        Ok(Self {
            plant,
            servo: ServoEmulator::new(1),
            brake: BrakeEmulator::new(1, Model::Rd6006),
            counter,
            readers: None,
            start: Instant::now(),
            period_ns: (1e9 / rate_hz).round() as u64,
            time_ns: 0,
            stream: Vec::new(),
            plugs: Default::default(),
            record: None,
            counts_from: [0; 2],
            passed_before: [None; 2],
            plant_counts: [0; 2],
        })
    }

    /// Keeps a record of the true shaft speeds from now on.
    pub fn keep_record(&mut self, record: ShaftRecord) {
        self.record = Some(record);
    }

    /// Pulls a device's plug: its line hangs up and cannot be dialled, while the device itself goes on.
    pub fn unplug(&mut self, kind: DeviceKind) {
        self.plugs[kind as usize].out = true;
        self.plugs[kind as usize].told.send_replace(());
    }

    /// Puts a device's plug in again.
    pub fn replug(&mut self, kind: DeviceKind) {
        self.plugs[kind as usize].out = false;
    }

    /// Notice of the next time that a device's plug is pulled; `None` while it is out.
    #[must_use]
    pub fn plug(&self, kind: DeviceKind) -> Option<watch::Receiver<()>> {
        let plug = &self.plugs[kind as usize];
        (!plug.out).then(|| plug.told.subscribe())
    }

    /// Presses or releases the emergency stop: a normally closed contact at the drive's input DI8.
    pub fn press_emergency_stop(&mut self, pressed: bool) {
        self.advance();
        self.servo.set_terminal(EMERGENCY_STOP_INPUT, !pressed, &mut self.plant);
    }

    /// Makes the drive one that has no watchdog: its register takes no value.
    pub fn take_watchdog_away(&mut self) {
        self.servo.forget_watchdog();
    }

    /// Sets what the brake's sensor shows beside its own temperature, °C.
    pub fn heat_brake_by(&mut self, by_c: f64) {
        self.brake.heat_by(by_c);
    }

    /// Makes the brake's source put out `factor` times the current that it is set to.
    pub fn run_brake_away(&mut self, factor: f64) {
        self.advance();
        self.brake.run_away(factor, &mut self.plant);
    }

    /// Makes the counter box send nothing at all, or speak again.
    pub fn silence_counter(&mut self, silent: bool) {
        self.advance();
        self.counter.set_silent(silent);
    }

    /// Makes the counter box begin anew, as after a cut of its power: stopped, counting from elsewhere.
    pub fn restart_counter(&mut self) {
        self.counter = CounterEmulator::new("SIM-0001", &self.plant);
        self.counts_from = [self.plant_counts[0] - 12_345, self.plant_counts[1] + 67_890];
        self.passed_before = [self.plant.input_index_counts(), self.plant.output_index_counts()];
    }

    /// The truth of the plant, now.
    pub fn truth(&mut self) -> Truth {
        self.advance();
        self.plant.truth()
    }

    /// Brings the plant up to now, and hands its samples to the counter box.
    pub fn advance(&mut self) {
        let now_ns = self.start.elapsed().as_nanos() as u64;
        if now_ns > self.time_ns + LONGEST_CATCH_UP_NS {
            self.time_ns = now_ns - LONGEST_CATCH_UP_NS;
        }
        while self.time_ns + self.period_ns <= now_ns {
            let sample = self.plant.step();
            self.time_ns += self.period_ns;
            self.plant_counts = [sample.input_counts, sample.output_counts];
            // A box that lost its power counts from elsewhere and knows no index that passed before.
            let [input_from, output_from] = self.counts_from;
            let seen = |index: Option<i64>, before: Option<i64>, from: i64| {
                index.filter(|_| index != before).map(|counts| counts - from)
            };
            let latched = Latched {
                input: sample.input_counts - input_from,
                output: sample.output_counts - output_from,
                input_index: seen(self.plant.input_index_counts(), self.passed_before[0], input_from),
                output_index: seen(self.plant.output_index_counts(), self.passed_before[1], output_from),
            };
            self.counter.sample(self.time_ns, &latched, &mut self.stream);
            if let Some(readers) = &mut self.readers {
                for (reader, count) in readers.iter_mut().zip(self.plant_counts) {
                    reader.sample(self.time_ns, count);
                }
            }
            if let Some(record) = &mut self.record {
                record.take(self.time_ns, &self.plant);
            }
        }
        self.servo.tick(now_ns, &mut self.plant);
        self.brake.tick(now_ns, &mut self.plant);
        self.counter.tick(now_ns, &mut self.stream);
    }

    /// Puts a QSB reader on each encoder, beside the counter box. Gives the counts at which both angles are zero.
    pub fn put_readers(&mut self, clocks: [QsbClock; 2]) -> [i64; 2] {
        self.readers = Some([QsbEmulator::new(clocks[0], 1), QsbEmulator::new(clocks[1], 2)]);
        // Both counts are 0 where the shafts stand now, input shaft and output disc.
        let [input, _, _, disc, _] = self.plant.truth().angles_rad;
        let (input_per_rev, output_per_rev) = self.plant.counts_per_rev();
        let zero = |angle: f64, per_rev: u64| -(angle / std::f64::consts::TAU * per_rev as f64).round() as i64;
        [zero(input, input_per_rev), zero(disc, output_per_rev)]
    }

    /// A reader's line: takes bytes from its master, and gives what it sends.
    pub fn exchange_with_reader(&mut self, which: usize, received: &[u8], sends: &mut Vec<u8>) {
        if let Some(reader) = self.readers.as_mut().and_then(|readers| readers.get_mut(which)) {
            reader.receive(received);
            reader.take_output(sends);
        }
    }

    /// Cuts a reader's power for an instant.
    pub fn restart_reader(&mut self, which: usize) {
        self.advance();
        let time_ns = self.time_ns;
        if let Some(reader) = self.readers.as_mut().and_then(|readers| readers.get_mut(which)) {
            reader.restart(time_ns);
        }
    }

    /// When the counter box looks for a full frame next.
    #[must_use]
    pub fn next_frame(&self) -> Instant {
        let periods = self.start.elapsed().as_nanos() / FRAME_PERIOD.as_nanos() + 1;
        self.start + Duration::from_nanos((periods * FRAME_PERIOD.as_nanos()) as u64)
    }

    /// Asks the servo drive.
    pub fn answer_servo(&mut self, request: &Request) -> Reply {
        self.servo.handle(self.time_ns, request, &mut self.plant)
    }

    /// Asks the brake's current source.
    pub fn answer_brake(&mut self, request: &Request) -> Reply {
        self.brake.handle(self.time_ns, request, &mut self.plant)
    }

    /// Gives the counter box bytes from its master; its answers join the stream.
    pub fn tell_counter(&mut self, bytes: &[u8]) {
        self.counter.receive(bytes, &mut self.stream);
        let Some(period_ns) = self.counter.sample_period_ns().map(u64::from) else { return };
        if period_ns != self.period_ns && self.plant.set_sample_rate_hz(1e9 / period_ns as f64).is_ok() {
            self.period_ns = period_ns;
        }
    }

    /// Takes what the counter box sends.
    pub fn take_stream(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.stream);
    }

    /// Tells the counter box whether its line takes bytes.
    pub fn set_line_blocked(&mut self, blocked: bool) {
        self.counter.set_line_blocked(blocked);
    }
}

impl ServoAxis for Plant {
    fn set_enabled(&mut self, enabled: bool) {
        self.set_enabled(enabled);
    }
    fn set_speed_reference_rpm(&mut self, rpm: f64) {
        self.set_speed_reference_rpm(rpm);
    }
    fn set_ramp_ms(&mut self, accel_ms: f64, decel_ms: f64) {
        self.set_ramp_ms(accel_ms, decel_ms);
    }
    fn speed_rpm(&self) -> f64 {
        self.speed_rpm()
    }
    fn torque_percent(&self) -> f64 {
        self.torque_percent()
    }
    fn reference_speed_after_ramp_rpm(&self) -> f64 {
        self.reference_speed_after_ramp_rpm()
    }
}

impl BrakeCoil for Plant {
    fn set_drive(&mut self, enabled: bool, current_limit_a: f64, voltage_limit_v: f64) {
        self.set_drive(enabled, current_limit_a, voltage_limit_v);
    }
    fn current_a(&self) -> f64 {
        self.current_a()
    }
    fn voltage_v(&self) -> f64 {
        self.voltage_v()
    }
    fn temperature_c(&self) -> f64 {
        self.temperature_c()
    }
}

impl EncoderPair for Plant {
    fn counts_per_rev(&self) -> (u64, u64) {
        self.counts_per_rev()
    }
    fn lines(&self) -> (u32, u32) {
        self.lines()
    }
}
