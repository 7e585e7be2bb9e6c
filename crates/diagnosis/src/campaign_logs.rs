//! Logs of one campaign as points for the gap diagnosis, on one clock: no more of them is held than a few batches.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread,
};

use gearmodel::NominalModel;
use riglog::{
    EncoderMetadata, LogError, LogParts, RunSpan, RunStream, RunTotals, RunVisitor, SampleBlock, StreamTotals,
};

use crate::line_phase::LinePhase;
use crate::reduce::{ReducedRun, Reducer, Sample};
use crate::{Nominal, Settings};

/// Blocks of samples that may wait between decoding and reducing.
const WAITING_BLOCKS: usize = 64;

const S_PER_NS: f64 = 1e-9;

/// Logs of one campaign, in order of their time whatever the order in which they were named.
#[derive(Debug)]
pub struct CampaignLogs {
    logs: Vec<(PathBuf, RunStream)>,
    origin_ns: u64,
}

/// Runs as points, and what the logs lack.
#[derive(Debug)]
pub struct ReducedLogs {
    /// Every run with what was seen of the encoders' lines, in order of time.
    pub runs: Vec<(ReducedRun, LinePhase)>,
    /// What every log was found to hold.
    pub totals: Vec<(PathBuf, StreamTotals)>,
}

impl ReducedLogs {
    /// Why the logs are incomplete, a line each; empty where they are whole.
    #[must_use]
    pub fn incomplete(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (path, totals) in &self.totals {
            if totals.losses_in_file > 0 {
                lines.push(format!("{}: {} samples are missing", path.display(), totals.losses_in_file));
            }
            if !totals.completeness.is_complete() {
                lines.push(format!("{}: {}", path.display(), totals.completeness));
            }
        }
        lines
    }
}

impl CampaignLogs {
    /// Looks for the runs of every log. A log that is named twice counts once, as do the parts of a log that was split.
    ///
    /// # Errors
    /// [`LogError`] as from [`RunStream::open`].
    pub fn open(paths: &[impl AsRef<Path>]) -> Result<Self, LogError> {
        let sets = LogParts::group(paths)?;
        let mut logs = Vec::new();
        for (set, stream) in sets.iter().zip(on_all_cores(&sets, |set| RunStream::open_parts(set.clone()))) {
            logs.push((set.first().to_owned(), stream?));
        }
        // Equal times: by name, so that the order in which they were named never matters.
        logs.sort_by(|(a, one), (b, other)| (one.start_ns(), a).cmp(&(other.start_ns(), b)));
        let origin_ns = logs.iter().filter_map(|(_, stream)| stream.start_ns()).min().unwrap_or(0);
        Ok(Self { logs, origin_ns })
    }

    /// The logs in order of time.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.logs.iter().map(|(path, _)| path.as_path())
    }

    /// The text of each log's `pair.toml`, in order of time.
    pub fn pair_texts(&self) -> impl Iterator<Item = Option<String>> {
        self.logs
            .iter()
            .map(|(_, log)| log.attachment("pair.toml").map(|text| String::from_utf8_lossy(text).into_owned()))
    }

    /// Where the recorded runs are from: `sim`, or the name of a profile.
    #[must_use]
    pub fn backend(&self) -> String {
        self.logs.iter().find_map(|(_, log)| log.metadata()).map(|run| run.backend.clone()).unwrap_or_default()
    }

    /// A nominal model with the encoders that the logs name.
    #[must_use]
    pub fn nominal(&self, model: NominalModel) -> Nominal {
        let encoders = self.logs.iter().find_map(|(_, log)| log.encoders());
        // As many lines as counts: a table that was imported, of whose discs nothing is known.
        let known = |lines: u64, counts: u64| (lines > 1 && lines < counts).then_some(lines as f64);
        let lines = encoders.map_or([None, None], |e: &EncoderMetadata| {
            [known(e.input_lines, e.input_counts_per_rev), known(e.output_lines, e.output_counts_per_rev)]
        });
        Nominal::new(model, lines, encoders.map(|e| e.output_counts_per_rev as f64))
    }

    /// Reads all samples once and gives the runs as points.
    ///
    /// # Errors
    /// [`LogError`] as from [`RunStream::stream`].
    pub fn reduce(&self, nominal: &Nominal, settings: &Settings) -> Result<ReducedLogs, LogError> {
        let found = match &self.logs[..] {
            [(_, log)] => vec![self.decode_beside_reducing(log, nominal, settings)],
            logs => on_all_cores(logs, |(_, log)| {
                let mut sink = Sink::new(nominal, settings);
                let mut visitor = Visitor { origin_ns: self.origin_ns, deliver: |parcel| sink.take(parcel) };
                let totals = log.stream(&mut visitor)?;
                Ok((sink.finish(), totals))
            }),
        };
        let mut reduced = ReducedLogs { runs: Vec::new(), totals: Vec::new() };
        for ((path, _), found) in self.logs.iter().zip(found) {
            let (runs, totals) = found?;
            reduced.runs.extend(runs);
            reduced.totals.push((path.clone(), totals));
        }
        Ok(reduced)
    }

    /// One core decodes while another reduces.
    fn decode_beside_reducing(
        &self,
        log: &RunStream,
        nominal: &Nominal,
        settings: &Settings,
    ) -> Result<(Runs, StreamTotals), LogError> {
        thread::scope(|scope| {
            let (sender, receiver): (SyncSender<Parcel>, Receiver<Parcel>) = sync_channel(WAITING_BLOCKS);
            let reducing = scope.spawn(move || {
                let mut sink = Sink::new(nominal, settings);
                while let Ok(parcel) = receiver.recv() {
                    sink.take(parcel);
                }
                sink.finish()
            });
            // The other end hangs up only when it panics; the join below then does, too.
            let mut visitor = Visitor { origin_ns: self.origin_ns, deliver: |parcel| drop(sender.send(parcel)) };
            let totals = log.stream(&mut visitor);
            drop(sender);
            let runs = reducing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            Ok((runs, totals?))
        })
    }
}

type Runs = Vec<(ReducedRun, LinePhase)>;

/// What goes from decoding to reducing.
enum Parcel {
    Run(RunSpan),
    Samples(Vec<Sample>),
}

/// Decodes into parcels.
struct Visitor<F> {
    origin_ns: u64,
    deliver: F,
}

impl<F: FnMut(Parcel)> RunVisitor for Visitor<F> {
    fn run_start(&mut self, _: usize, span: &RunSpan) -> ControlFlow<()> {
        (self.deliver)(Parcel::Run(*span));
        ControlFlow::Continue(())
    }

    fn samples(&mut self, _: usize, block: &SampleBlock<'_>) -> ControlFlow<()> {
        let angles = block.theta1_rad.iter().zip(block.theta2_rad);
        let samples = block
            .time_ns
            .iter()
            .zip(angles)
            .map(|(time_ns, (theta1_rad, theta2_rad))| Sample {
                time_s: time_ns.saturating_sub(self.origin_ns) as f64 * S_PER_NS,
                theta1_rad: *theta1_rad,
                theta2_rad: *theta2_rad,
                // The run's, which only the reducing side knows.
                load_nm: f64::NAN,
            })
            .collect();
        (self.deliver)(Parcel::Samples(samples));
        ControlFlow::Continue(())
    }

    fn run_end(&mut self, _: usize, _: &RunSpan, _: &RunTotals) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Takes parcels, run after run.
struct Sink<'a> {
    nominal: &'a Nominal,
    settings: &'a Settings,
    under_way: Option<(Reducer<'a>, f64)>,
    runs: Runs,
}

impl<'a> Sink<'a> {
    fn new(nominal: &'a Nominal, settings: &'a Settings) -> Self {
        Self { nominal, settings, under_way: None, runs: Vec::new() }
    }

    fn take(&mut self, parcel: Parcel) {
        match parcel {
            Parcel::Run(span) => {
                self.close();
                let reducer = Reducer::new(self.nominal, span.direction, span.speed_rpm.abs(), self.settings);
                self.under_way = Some((reducer, span.load_nm));
            }
            Parcel::Samples(samples) => {
                if let Some((reducer, load_nm)) = &mut self.under_way {
                    samples.into_iter().for_each(|sample| reducer.push(Sample { load_nm: *load_nm, ..sample }));
                }
            }
        }
    }

    fn close(&mut self) {
        if let Some((reducer, _)) = self.under_way.take() {
            self.runs.push(reducer.finish());
        }
    }

    fn finish(mut self) -> Runs {
        self.close();
        self.runs
    }
}

/// Applies `work` to every item on all cores; the results are in the items' order.
fn on_all_cores<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let cores = thread::available_parallelism().map_or(1, usize::from).min(items.len());
    if cores <= 1 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, R)>> = Mutex::default();
    thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some((n, item)) = {
                    let n = next.fetch_add(1, Ordering::Relaxed);
                    items.get(n).map(|item| (n, item))
                } {
                    let result = work(item);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((n, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(n, _)| *n);
    done.into_iter().map(|(_, result)| result).collect()
}
