//! The emulated counter box. Frames: [`wire::counter_box`], `docs/wire/counter-box.md`.

use wire::counter_box::{
    Ack, AckStatus, BoxStatus, Command, Encoder, Frame, Identity, MAX_SAMPLES_PER_FRAME, PROTOCOL_VERSION, SampleFlags,
    Samples, StreamDecoder,
};

use super::interface::EncoderPair;

/// Fastest sampling, Hz.
const MAX_SAMPLE_RATE_HZ: u32 = 200_000;
/// A frame is sent when its first sample is this old, even if it is not full, ns.
const MAX_FRAME_AGE_NS: u64 = 100_000_000;

/// What the box latches at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Latched {
    /// Input count.
    pub input: i64,
    /// Output count.
    pub output: i64,
    /// Input count at its latest index pulse, if one was ever seen.
    pub input_index: Option<i64>,
    /// Output count at its latest index pulse, if one was ever seen.
    pub output_index: Option<i64>,
}

/// The emulated box. The plant's owner gives it a sample each period while [`sample_period_ns`] asks for them.
///
/// [`sample_period_ns`]: CounterEmulator::sample_period_ns
#[derive(Debug, Clone)]
pub struct CounterEmulator {
    identity: Identity,
    decoder: StreamDecoder,
    encoder: Encoder,
    commands: Vec<Frame>,
    running: Option<Running>,
    /// What has been collected for the next frame.
    pending: Samples,
    /// Counts of the latest sample in `pending`.
    previous: (i64, i64),
    /// Flags that the next frame carries.
    flags: SampleFlags,
    /// Latches already reported.
    reported_index: (Option<i64>, Option<i64>),
    line_blocked: bool,
    silent: bool,
    corrupt_frames: u32,
    dropped_samples: u64,
}

#[derive(Debug, Clone, Copy)]
struct Running {
    period_ns: u32,
    samples_per_frame: usize,
    next_sequence: u32,
    next_sample: u64,
}

impl CounterEmulator {
    /// A box with this serial number on these encoders, stopped.
    pub fn new(serial: &str, encoders: &dyn EncoderPair) -> Self {
        let (input_counts_per_rev, output_counts_per_rev) = encoders.counts_per_rev();
        let (input_lines, output_lines) = encoders.lines();
        Self {
            identity: Identity {
                request_id: 0,
                protocol_version: PROTOCOL_VERSION,
                input_counts_per_rev,
                output_counts_per_rev,
                input_lines,
                output_lines,
                max_sample_rate_hz: MAX_SAMPLE_RATE_HZ,
                status: BoxStatus::default(),
                serial: serial.to_owned(),
                firmware: "1.0.0".to_owned(),
            },
            decoder: StreamDecoder::new(),
            encoder: Encoder::new(),
            commands: Vec::new(),
            running: None,
            pending: Samples::default(),
            previous: (0, 0),
            flags: SampleFlags::default(),
            reported_index: (None, None),
            line_blocked: false,
            silent: false,
            corrupt_frames: 0,
            dropped_samples: 0,
        }
    }

    /// Time between samples while it is sampling, ns.
    pub fn sample_period_ns(&self) -> Option<u32> {
        self.running.map(|running| running.period_ns)
    }

    /// Samples thrown away because the line was blocked.
    pub fn dropped_samples(&self) -> u64 {
        self.dropped_samples
    }

    /// Tells the box whether the line takes bytes. While it does not, whole frames are dropped.
    pub fn set_line_blocked(&mut self, blocked: bool) {
        self.line_blocked = blocked;
    }

    /// Makes the box answer and send nothing at all.
    pub fn set_silent(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// Flips a bit in each of the next frames.
    pub fn corrupt_frames(&mut self, count: u32) {
        self.corrupt_frames = count;
    }

    /// Reports bad signals of the encoders, or good ones again.
    pub fn set_signal_fault(&mut self, input: bool, output: bool) {
        let mut status = self.identity.status.0 & !(BoxStatus::INPUT_FAULT | BoxStatus::OUTPUT_FAULT);
        for (bad, status_bit, flag) in [
            (input, BoxStatus::INPUT_FAULT, SampleFlags::INPUT_FAULT),
            (output, BoxStatus::OUTPUT_FAULT, SampleFlags::OUTPUT_FAULT),
        ] {
            if bad {
                status |= status_bit;
                self.flags.set(flag);
            }
        }
        self.identity.status = BoxStatus(status);
    }

    /// Takes bytes from the host and appends the answers.
    pub fn receive(&mut self, bytes: &[u8], out: &mut Vec<u8>) {
        let mut commands = std::mem::take(&mut self.commands);
        self.decoder.feed(bytes, &mut commands);
        for frame in commands.drain(..) {
            if let Frame::Command(command) = frame {
                self.obey(command, out);
            }
        }
        self.commands = commands;
    }

    fn obey(&mut self, command: Command, out: &mut Vec<u8>) {
        let request_id = command.request_id();
        let status = match command {
            Command::Identify { .. } => {
                let mut identity = self.identity.clone();
                identity.request_id = request_id;
                identity.status.0 |= if self.running.is_some() { BoxStatus::RUNNING } else { 0 };
                self.send(&Frame::Identity(identity), out);
                return;
            }
            Command::Start { sample_period_ns, samples_per_frame, .. } => {
                self.start(sample_period_ns, samples_per_frame)
            }
            Command::Stop { .. } => {
                self.flush(out);
                self.running = None;
                AckStatus::Done
            }
        };
        self.send(&Frame::Ack(Ack { request_id, status }), out);
    }

    fn start(&mut self, period_ns: u32, samples_per_frame: u16) -> AckStatus {
        if u64::from(period_ns) * u64::from(MAX_SAMPLE_RATE_HZ) < 1_000_000_000 {
            return AckStatus::BadPeriod;
        }
        if samples_per_frame == 0 || samples_per_frame > MAX_SAMPLES_PER_FRAME {
            return AckStatus::BadFrameSize;
        }
        let samples_per_frame = usize::from(samples_per_frame);
        self.running = Some(Running { period_ns, samples_per_frame, next_sequence: 0, next_sample: 0 });
        self.clear_pending();
        // The counters run on from power-up, so an index that passed before is still good: the first frame reports it.
        self.reported_index = (None, None);
        self.flags = SampleFlags::default();
        let status = self.identity.status;
        self.set_signal_fault(status.has(BoxStatus::INPUT_FAULT), status.has(BoxStatus::OUTPUT_FAULT));
        AckStatus::Done
    }

    /// Takes a sample, latched at `device_time_ns`, and appends the frame that it completes. Ignored while stopped.
    #[inline]
    pub fn sample(&mut self, device_time_ns: u64, latched: &Latched, out: &mut Vec<u8>) {
        let Some(running) = self.running else {
            return;
        };
        let count = self.pending.len() as u64;
        let on_time = self.pending.device_time_ns.wrapping_add(count * u64::from(running.period_ns));
        let deltas = (delta(self.previous.0, latched.input), delta(self.previous.1, latched.output));
        match deltas {
            (Some(input), Some(output)) if count != 0 && device_time_ns == on_time => {
                self.pending.input_delta.push(input);
                self.pending.output_delta.push(output);
            }
            _ => {
                // Times within a frame are exact and deltas are 32 bits wide; whatever does not fit starts a new one.
                self.flush(out);
                self.pending.device_time_ns = device_time_ns;
                self.pending.input_base = latched.input;
                self.pending.output_base = latched.output;
                self.pending.input_delta.push(0);
                self.pending.output_delta.push(0);
            }
        }
        self.previous = (latched.input, latched.output);
        if (latched.input_index, latched.output_index) != self.reported_index {
            self.latch(latched);
        }
        if self.pending.len() >= running.samples_per_frame {
            self.flush(out);
        }
    }

    /// Lets time pass: a frame that has waited too long is sent as it is.
    pub fn tick(&mut self, now_ns: u64, out: &mut Vec<u8>) {
        if !self.pending.is_empty() && now_ns.saturating_sub(self.pending.device_time_ns) >= MAX_FRAME_AGE_NS {
            self.flush(out);
        }
    }

    #[cold]
    fn latch(&mut self, latched: &Latched) {
        if let Some(counts) = latched.input_index.filter(|_| latched.input_index != self.reported_index.0) {
            self.pending.input_index_counts = counts;
            self.flags.set(SampleFlags::INPUT_INDEX);
        }
        if let Some(counts) = latched.output_index.filter(|_| latched.output_index != self.reported_index.1) {
            self.pending.output_index_counts = counts;
            self.flags.set(SampleFlags::OUTPUT_INDEX);
        }
        self.reported_index = (latched.input_index, latched.output_index);
    }

    /// Sends or, on a blocked line, drops what is pending.
    fn flush(&mut self, out: &mut Vec<u8>) {
        let Some(running) = self.running.as_mut().filter(|_| !self.pending.is_empty()) else {
            return;
        };
        let count = self.pending.len() as u64;
        self.pending.first_sample = running.next_sample;
        running.next_sample += count;
        if self.line_blocked {
            // Index flags stay set and go out with the next frame that gets through.
            self.dropped_samples += count;
            self.flags.set(SampleFlags::OVERFLOW);
        } else {
            self.pending.sequence = running.next_sequence;
            running.next_sequence = running.next_sequence.wrapping_add(1);
            self.pending.dt_ns = running.period_ns;
            self.pending.flags = std::mem::take(&mut self.flags);
            let start = out.len();
            // The batch is built here: never empty, too long, unequal, or based wrongly.
            let encoded = self.encoder.samples(&self.pending, out);
            debug_assert!(encoded.is_ok(), "{encoded:?}");
            self.spoil(start, out);
            // A lasting fault marks every frame.
            let status = self.identity.status;
            self.set_signal_fault(status.has(BoxStatus::INPUT_FAULT), status.has(BoxStatus::OUTPUT_FAULT));
        }
        self.clear_pending();
    }

    /// Empties the batch but keeps its memory and its latches.
    fn clear_pending(&mut self) {
        self.pending.input_delta.clear();
        self.pending.output_delta.clear();
    }

    fn send(&mut self, frame: &Frame, out: &mut Vec<u8>) {
        let start = out.len();
        // An identity with too long a serial number has no frame; the box is mute on it, as a real one would be.
        if self.encoder.frame(frame, out).is_ok() {
            self.spoil(start, out);
        }
    }

    /// Applies the line's faults to the frame that begins at `start`.
    fn spoil(&mut self, start: usize, out: &mut Vec<u8>) {
        if self.silent {
            out.truncate(start);
        } else if self.corrupt_frames > 0 && out.len() > start {
            self.corrupt_frames -= 1;
            // In the middle, where it is neither delimiter nor always the same field.
            let middle = start + (out.len() - start) / 2;
            out[middle] ^= 0x10;
        }
    }
}

/// Difference of two counts, if 32 bits hold it.
fn delta(from: i64, to: i64) -> Option<i32> {
    i32::try_from(to.wrapping_sub(from)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Encoders;

    impl EncoderPair for Encoders {
        fn counts_per_rev(&self) -> (u64, u64) {
            (7_200_000, 3_600_000)
        }
        fn lines(&self) -> (u32, u32) {
            (18_000, 9_000)
        }
    }

    const PERIOD_NS: u32 = 100_000;

    fn counter() -> CounterEmulator {
        CounterEmulator::new("SIM-1", &Encoders)
    }

    fn command(device: &mut CounterEmulator, command: Command) -> Vec<Frame> {
        let (mut bytes, mut out) = (Vec::new(), Vec::new());
        Encoder::new().command(&command, &mut bytes);
        device.receive(&bytes, &mut out);
        frames(&out)
    }

    fn frames(bytes: &[u8]) -> Vec<Frame> {
        let mut frames = Vec::new();
        StreamDecoder::new().feed(bytes, &mut frames);
        frames
    }

    fn start(device: &mut CounterEmulator, samples_per_frame: u16) -> AckStatus {
        let start = Command::Start { request_id: 5, sample_period_ns: PERIOD_NS, samples_per_frame };
        match command(device, start).as_slice() {
            [Frame::Ack(Ack { request_id: 5, status })] => *status,
            other => panic!("{other:?}"),
        }
    }

    /// Samples n of a steady motion.
    fn feed(device: &mut CounterEmulator, range: std::ops::Range<u64>, out: &mut Vec<u8>) {
        for n in range {
            let latched = Latched { input: n as i64 * 60, output: n as i64 * -30, ..Latched::default() };
            device.sample(n * u64::from(PERIOD_NS), &latched, out);
        }
    }

    fn batches(bytes: &[u8]) -> Vec<Samples> {
        frames(bytes)
            .into_iter()
            .map(|frame| match frame {
                Frame::Samples(samples) => samples,
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn says_who_it_is() {
        let mut device = counter();
        let answer = command(&mut device, Command::Identify { request_id: 77 });
        let [Frame::Identity(identity)] = answer.as_slice() else { panic!("{answer:?}") };
        assert_eq!((identity.request_id, identity.serial.as_str()), (77, "SIM-1"));
        assert_eq!((identity.input_counts_per_rev, identity.output_lines), (7_200_000, 9_000));
        assert!(!identity.status.has(BoxStatus::RUNNING));
    }

    #[test]
    fn streams_every_sample_once() {
        let mut device = counter();
        let mut out = Vec::new();
        feed(&mut device, 0..50, &mut out);
        assert!(out.is_empty(), "it has not been started");
        assert_eq!(start(&mut device, 20), AckStatus::Done);
        feed(&mut device, 100..150, &mut out);
        let mut stopped = Vec::new();
        let mut stop = Vec::new();
        Encoder::new().command(&Command::Stop { request_id: 6 }, &mut stop);
        device.receive(&stop, &mut stopped);
        let Some(Frame::Ack(ack)) = frames(&stopped).pop() else { panic!("no ack") };
        assert_eq!(ack, Ack { request_id: 6, status: AckStatus::Done });
        out.extend(&stopped[..stopped.len() - 10]);
        let batches = batches(&out);
        let heads: Vec<_> = batches.iter().map(|batch| (batch.sequence, batch.first_sample, batch.len())).collect();
        assert_eq!(heads, [(0, 0, 20), (1, 20, 20), (2, 40, 10)]);
        let inputs: Vec<i64> = batches.iter().flat_map(|batch| batch.input_counts().collect::<Vec<_>>()).collect();
        assert_eq!(inputs, (100..150).map(|n| n * 60).collect::<Vec<i64>>());
        assert_eq!(batches[1].device_time_ns, 120 * u64::from(PERIOD_NS));
    }

    #[test]
    fn refuses_what_it_cannot() {
        let mut device = counter();
        assert_eq!(start(&mut device, 0), AckStatus::BadFrameSize);
        assert_eq!(start(&mut device, MAX_SAMPLES_PER_FRAME + 1), AckStatus::BadFrameSize);
        let fast = Command::Start { request_id: 1, sample_period_ns: 4_999, samples_per_frame: 10 };
        let refused = Ack { request_id: 1, status: AckStatus::BadPeriod };
        assert_eq!(command(&mut device, fast), [Frame::Ack(refused)]);
        assert_eq!(device.sample_period_ns(), None);
    }

    #[test]
    fn a_blocked_line_drops_whole_frames_and_says_so() {
        let mut device = counter();
        start(&mut device, 10);
        let mut out = Vec::new();
        feed(&mut device, 0..10, &mut out);
        device.set_line_blocked(true);
        feed(&mut device, 10..30, &mut out);
        device.set_line_blocked(false);
        feed(&mut device, 30..50, &mut out);
        let batches = batches(&out);
        let heads: Vec<_> = batches.iter().map(|batch| (batch.sequence, batch.first_sample)).collect();
        assert_eq!(heads, [(0, 0), (1, 30), (2, 40)]);
        assert!(batches[1].flags.has(SampleFlags::OVERFLOW) && !batches[2].flags.has(SampleFlags::OVERFLOW));
        assert_eq!(batches[1].input_base, 30 * 60);
        assert_eq!(device.dropped_samples(), 20);
    }

    #[test]
    fn an_index_is_reported_once_and_its_latch_kept() {
        let mut device = counter();
        start(&mut device, 2);
        let mut out = Vec::new();
        for n in 0..6u64 {
            let input_index = (n >= 2).then_some(4321);
            let latched = Latched { input_index, ..Latched::default() };
            device.sample(n * u64::from(PERIOD_NS), &latched, &mut out);
        }
        let batches = batches(&out);
        let flags: Vec<bool> = batches.iter().map(|batch| batch.flags.has(SampleFlags::INPUT_INDEX)).collect();
        assert_eq!(flags, [false, true, false]);
        assert_eq!((batches[1].input_index_counts, batches[2].input_index_counts), (4321, 4321));
        assert!(batches.iter().all(|batch| !batch.flags.has(SampleFlags::OUTPUT_INDEX)));
    }

    #[test]
    fn a_late_sample_or_a_wide_step_starts_a_new_frame() {
        let mut device = counter();
        start(&mut device, 100);
        let mut out = Vec::new();
        feed(&mut device, 0..5, &mut out);
        let late = Latched { input: 300, output: -150, ..Latched::default() };
        device.sample(5 * u64::from(PERIOD_NS) + 7, &late, &mut out);
        let wide = Latched { input: 1 << 40, ..late };
        device.sample(6 * u64::from(PERIOD_NS) + 7, &wide, &mut out);
        device.tick(u64::from(PERIOD_NS) * 6 + MAX_FRAME_AGE_NS + 7, &mut out);
        let heads: Vec<_> =
            batches(&out).iter().map(|batch| (batch.first_sample, batch.len(), batch.input_base)).collect();
        assert_eq!(heads, [(0, 5, 0), (5, 1, 300), (6, 1, 1 << 40)]);
    }

    #[test]
    fn faults_of_the_line() {
        let mut device = counter();
        start(&mut device, 10);
        device.corrupt_frames(1);
        let mut out = Vec::new();
        feed(&mut device, 0..20, &mut out);
        assert_eq!(batches(&out).len(), 1);
        device.set_signal_fault(true, false);
        out.clear();
        feed(&mut device, 20..40, &mut out);
        assert!(batches(&out).iter().all(|batch| batch.flags.has(SampleFlags::INPUT_FAULT)));
        device.set_silent(true);
        out.clear();
        feed(&mut device, 40..60, &mut out);
        assert!(out.is_empty() && command(&mut device, Command::Identify { request_id: 1 }).is_empty());
    }
}
