//! The path from a batch to the log: exact run boundaries, counted losses, and the same bits on replay.

use std::path::{Path, PathBuf};

use gearmodel::Direction;
use gearmodel::measure::RunConditions;
use rigd::analysis::Analysis;
use rigd::clock::Clock;
use rigd::device::{CounterIdentity, Zero};
use rigd::profile::Profile;
use rigd::replay;
use rigd::run::acquire::Acquisition;
use rigd::run::recorder::{Entry, Recorder};
use riglog::pair;
use riglog::proto::Phase;
use riglog::{LogReader, Record, WriterOptions};
use tempfile::TempDir;
use wire::{SampleFlags, Samples};

const COUNTS: u64 = 7_200_000;
const DT_NS: u32 = 100_000;
const BATCH: usize = 100;
/// The model knows errors (2 mrad peak-to-peak and more) that this source has not.
const MODEL_ERRORS_RAD: f64 = 5e-3;

/// A counter box on a rig that turns evenly and without error.
struct Source {
    analysis: Analysis,
    sample: u64,
    theta1_rad: f64,
    step_rad: f64,
}

impl Source {
    fn batch(&mut self) -> Samples {
        let counts = |theta: f64| (theta / std::f64::consts::TAU * COUNTS as f64).round() as i64;
        let mut samples = Samples {
            device_time_ns: self.sample * u64::from(DT_NS),
            dt_ns: DT_NS,
            first_sample: self.sample,
            flags: SampleFlags(SampleFlags::INPUT_INDEX | SampleFlags::OUTPUT_INDEX),
            ..Samples::default()
        };
        let (mut input, mut output) = (0, 0);
        for n in 0..BATCH {
            let (next_input, next_output) =
                (counts(self.theta1_rad), counts(self.analysis.model().pair.theta2(self.theta1_rad)));
            if n == 0 {
                (samples.input_base, samples.output_base) = (next_input, next_output);
                samples.input_delta.push(0);
                samples.output_delta.push(0);
            } else {
                samples.input_delta.push((next_input - input) as i32);
                samples.output_delta.push((next_output - output) as i32);
            }
            (input, output) = (next_input, next_output);
            self.theta1_rad += self.step_rad;
            self.sample += 1;
        }
        samples
    }
}

/// Records one revolution; `arrives` may change a batch and says whether it reaches us. Also the largest excursion of TE.
fn record(
    directory: &Path,
    direction: Direction,
    arrives: impl Fn(usize, &mut Samples) -> bool,
) -> (PathBuf, Analysis, u64, f64) {
    let (pair_toml, model) = pair::load(None).expect("the built-in pair");
    let path = directory.join("run.mcap");
    let recorder = Recorder::create(&path, WriterOptions::new("test"), &Profile::simulated().log).expect("a log");
    recorder.write(0, 0, Entry::Attachment("pair.toml", "application/toml", pair_toml.into_bytes()));
    let mut acquisition = Acquisition::new(recorder, Clock::simulated(), Analysis::new(model.clone()));
    let identity = CounterIdentity {
        text: String::new(),
        counts_per_rev: [COUNTS; 2],
        lines: [18_000; 2],
        max_rate_hz: 1e6,
        own_rate: false,
        zero: Zero::Index,
    };
    acquisition.set_encoders(&identity, [1, 1], "none").expect("the first encoders");
    let mut source = Source {
        analysis: Analysis::new(model),
        sample: 0,
        theta1_rad: 0.1234 * direction.sign(),
        step_rad: direction.sign() * std::f64::consts::TAU / 2003.7,
    };
    acquisition.take(&source.batch());
    acquisition.home();
    acquisition.status.direction = Some(direction);
    acquisition.status.phase = Phase::Settle;
    acquisition.arm(RunConditions { direction, load_nm: 0.0, speed_rpm: 5.0 }, 1.0);
    for n in 0.. {
        let mut batch = source.batch();
        if arrives(n, &mut batch) {
            acquisition.take(&batch);
        }
        if acquisition.recorded() {
            break;
        }
    }
    let recorded = acquisition.recorded_samples();
    let excursion_rad = acquisition.latest.excursion_rad;
    let (recorder, analysis) = acquisition.into_parts();
    recorder.finish().expect("a whole log");
    (path, analysis, recorded, excursion_rad)
}

#[tokio::test]
async fn a_run_is_exactly_one_revolution_and_replays_to_the_same_bits() {
    for direction in [Direction::Ccw, Direction::Cw] {
        let directory = TempDir::new().expect("a temporary directory");
        let (path, analysis, recorded, excursion_rad) = record(directory.path(), direction, |_, _| true);
        assert!(excursion_rad < MODEL_ERRORS_RAD, "{excursion_rad}");
        // 2003.7 samples a revolution: 2003 or 2004 of them lie within one.
        assert!((2003..=2004).contains(&recorded), "{direction}: {recorded}");
        let info = riglog::info(&path).expect("a log");
        assert_eq!((info.samples, info.losses, info.runs.len()), (recorded, 0, 1));
        let mut again = Analysis::new(analysis.model().clone());
        replay::replay(&[path], &mut again, None).expect("it replays");
        assert_eq!(again.te_hash(), analysis.te_hash());
        assert_ne!(again.te_hash(), Analysis::new(analysis.model().clone()).te_hash());
        // No error, no load: TE is the designed backlash of the flank, and the counts' rounding.
        let te = again.runs()[0].te.mean_curve();
        let residual = te.values_rad.iter().map(|value| value.abs()).fold(0.0, f64::max);
        assert!(residual < 2.0 * std::f64::consts::TAU / COUNTS as f64, "{residual}");
    }
}

#[tokio::test]
async fn a_lost_batch_is_counted_told_and_never_filled_in() {
    let directory = TempDir::new().expect("a temporary directory");
    let (path, analysis, recorded, _) = record(directory.path(), Direction::Ccw, |n, _| n != 7 && n != 8);
    assert_eq!(analysis.runs()[0].losses, 2 * BATCH as u64);
    let info = riglog::info(&path).expect("a log");
    assert_eq!((info.samples, info.losses), (recorded, 2 * BATCH as u64));
    let events: Vec<String> = LogReader::open(&path)
        .expect("a log")
        .filter_map(|record| match record.expect("a record") {
            Record::Event { event, .. } => Some(event.message),
            _ => None,
        })
        .collect();
    assert!(events.iter().any(|event| event.contains("200 lost")), "{events:?}");
    let mut again = Analysis::new(analysis.model().clone());
    let replayed = replay::replay(&[path], &mut again, None).expect("it replays");
    assert_eq!((replayed.losses, again.te_hash()), (200, analysis.te_hash()));
    assert!(!replayed.incomplete.is_empty());
}

#[tokio::test]
async fn a_jump_of_te_is_kept_for_the_supervisor_whose_polls_are_rarer_than_batches() {
    let directory = TempDir::new().expect("a temporary directory");
    let jump = COUNTS as i64 / 100;
    let (.., excursion_rad) = record(directory.path(), Direction::Ccw, |n, batch| {
        batch.output_base += if n == 9 { jump } else { 0 };
        true
    });
    let expected = std::f64::consts::TAU / 100.0;
    assert!((excursion_rad - expected).abs() < MODEL_ERRORS_RAD, "{excursion_rad} against {expected}");
}

#[test]
fn a_zero_without_an_index_is_taken_once_and_not_found_again() {
    let (_, model) = pair::load(None).expect("the built-in pair");
    let directory = TempDir::new().expect("a temporary directory");
    let path = directory.path().join("run.mcap");
    let recorder = Recorder::create(&path, WriterOptions::new("test"), &Profile::simulated().log).expect("a log");
    let mut acquisition = Acquisition::new(recorder, Clock::simulated(), Analysis::new(model));
    let zero = Zero::Counts([-1000, 2000]);
    let identity = CounterIdentity {
        text: String::new(),
        counts_per_rev: [COUNTS; 2],
        lines: [18_000; 2],
        max_rate_hz: 512.0,
        own_rate: true,
        zero,
    };
    acquisition.set_encoders(&identity, [1, 1], "none").expect("the first encoders");
    assert!(!acquisition.has_index());
    assert!(acquisition.home_without_index(), "taken");
    assert!(acquisition.home_without_index(), "still known: the stream went on");
    acquisition.stream_lost();
    assert!(!acquisition.home_without_index(), "nothing says where the counts begin now");
    acquisition.into_parts().0.finish().expect("a log");
    let info = riglog::info(&path).expect("a readable log");
    assert_eq!(info.metadata["rig.encoders"]["input_index_counts"], "-1000");
}
