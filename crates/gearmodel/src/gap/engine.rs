//! The diagnosis from recordings to answer: each step in its own file, here in order.

use rayon::prelude::*;

use super::attribute::{self, Attribution, twins};
use super::diagnosis::{Confusability, Diagnosis, EffectFinding, Group, Unknown, UnknownLocation, Verdict};
use super::grid::Grid;
use super::line_phase::{LineError, LinePhase};
use super::nominal::Nominal;
use super::noise::{FIRST_RUN_RATIO, Noise, Whitened};
use super::pool::{Cause, Pool};
use super::predict::{Found, FoundEffect};
use super::reduce::{ReducedRun, Reducer, Sample};
use super::search::{Model, Search};
use super::unknown::Pattern;
use super::{events, evidence, interpolation, locate, next, shrink};
use crate::effect::{Estimate, LIBRARY, Rig, by_name};
use crate::recording::Recording;
use crate::{Direction, NominalModel};

/// Ratios of the scatter between runs to that between revolutions that are weighed against one another.
const RUN_RATIOS: [f64; 6] = [0.02, 0.08, 0.3, 1.0, 3.0, 10.0];
/// How far such a ratio usually is from what it is first taken to be: a factor of e to this.
const RUN_RATIO_SPREAD: f64 = 1.5;
/// Rounds of: search, look for events, sharpen shapes, estimate the noise anew.
const ROUNDS: usize = 3;
/// Log Bayes factor from which a sub-divisional error is taken off.
const LINE_NATS: f64 = 4.0;
/// Probability from which an effect is named.
const NAMED: f64 = 0.5;

/// What may be said before the data is looked at.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Effects that are there: always in the model.
    pub known: Vec<String>,
    /// Effects that are not.
    pub exclude: Vec<String>,
}

/// Why there is no diagnosis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// No recording at all.
    #[error("no recording was given: at least 1 is needed")]
    NoRecording,
    /// Recordings without a stretch in which the driver turns.
    #[error("{recordings} recordings hold {points} stretches of motion together: at least {needed} are needed (a quarter degree each)")]
    TooShort {
        /// Recordings given.
        recordings: usize,
        /// Stretches found.
        points: usize,
        /// Least number.
        needed: usize,
    },
    /// An effect that the library does not have.
    #[error("effect {name:?} is unknown: the library has {allowed}")]
    UnknownEffect {
        /// The name given.
        name: String,
        /// The names there are.
        allowed: String,
    },
    /// The sums over the recordings cannot be solved.
    #[error("the residuals cannot be fitted: their sums are not finite; check the angles and loads for absurd values")]
    Singular,
    /// Both known and excluded.
    #[error("effect {name:?} is both known and excluded: name it in one of the two")]
    KnownAndExcluded {
        /// The name.
        name: String,
    },
}

/// Fewest points of a diagnosis.
const FEWEST_POINTS: usize = 60;

impl Options {
    fn check(&self) -> Result<(), GapError> {
        for name in self.known.iter().chain(&self.exclude) {
            if by_name(name).is_none() {
                let allowed = LIBRARY.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ");
                return Err(GapError::UnknownEffect { name: name.clone(), allowed });
            }
        }
        match self.known.iter().find(|name| self.exclude.contains(name)) {
            Some(name) => Err(GapError::KnownAndExcluded { name: name.clone() }),
            None => Ok(()),
        }
    }
}

/// Diagnoses recordings against a nominal model; recordings that reverse are split at their reversals, and all share one
/// clock.
///
/// # Errors
/// [`GapError`] when there is too little motion or an effect is named that does not exist.
pub fn diagnose(recordings: &[Recording<'_>], model: &NominalModel, options: &Options) -> Result<Diagnosis, GapError> {
    diagnose_with_nominal(recordings, model, options).map(|(diagnosis, _)| diagnosis)
}

/// [`diagnose`], with the nominal model that the residual was taken against.
///
/// # Errors
/// As for [`diagnose`].
pub fn diagnose_with_nominal(
    recordings: &[Recording<'_>],
    model: &NominalModel,
    options: &Options,
) -> Result<(Diagnosis, Nominal), GapError> {
    if recordings.is_empty() {
        return Err(GapError::NoRecording);
    }
    let lines = [0, 1].map(|encoder| {
        recordings
            .iter()
            .find_map(|r| if encoder == 0 { r.columns().input_lines } else { r.columns().output_lines })
            .map(|lines| lines as f64)
    });
    let quantum = recordings.iter().find_map(|r| interpolation::counts_per_rev(&r.columns().theta2_rad));
    let nominal = Nominal::new(Rig::new(model.clone(), lines, quantum));
    let parts: Vec<Recording<'_>> = recordings.iter().flat_map(Recording::split).collect();
    let reduced: Vec<(ReducedRun, LinePhase)> = parts
        .par_iter()
        .map(|part| {
            let columns = part.columns();
            let direction = columns.direction.unwrap_or(Direction::Ccw);
            let mut reducer = Reducer::new(&nominal, direction, columns.speed_rpm.mean().abs());
            let load = columns.load_nm.mean();
            for n in 0..part.samples() {
                reducer.push(Sample {
                    time_s: columns.time_s[n],
                    theta1_rad: columns.theta1_rad[n],
                    theta2_rad: columns.theta2_rad[n],
                    load_nm: columns.load_nm.at(n).unwrap_or(load),
                });
            }
            reducer.finish()
        })
        .collect();
    let diagnosis = diagnose_runs(&nominal, reduced, options)?;
    Ok((diagnosis, nominal))
}

/// Diagnoses runs that were reduced before, as when they are read from a log sample by sample.
///
/// # Errors
/// As for [`diagnose`].
pub fn diagnose_runs(
    nominal: &Nominal,
    reduced: Vec<(ReducedRun, LinePhase)>,
    options: &Options,
) -> Result<Diagnosis, GapError> {
    options.check()?;
    let recordings = reduced.len();
    let mut lines: Option<LinePhase> = None;
    let mut runs = Vec::new();
    for (run, seen) in reduced {
        match &mut lines {
            Some(sum) => sum.merge(&seen),
            None => lines = Some(seen),
        }
        runs.push(run);
    }
    let mut runs = join(runs);
    nominal.take_off_effects(&mut runs);
    let points = runs.iter().map(|run| run.points.len()).sum();
    if points < FEWEST_POINTS {
        return Err(GapError::TooShort { recordings, points, needed: FEWEST_POINTS });
    }
    let found_lines = take_off_lines(&mut runs, lines.as_ref(), options);
    let mut engine = Engine::new(nominal.rig(), runs, options);
    engine.solve();
    engine.report(&found_lines).ok_or(GapError::Singular)
}

/// Finds sub-divisional errors and takes them off the points, so that they are no noise for the rest.
fn take_off_lines(runs: &mut [ReducedRun], lines: Option<&LinePhase>, options: &Options) -> Vec<LineError> {
    let names = ["encoder1_interpolation", "encoder2_interpolation"];
    let found: Vec<LineError> = (0..2)
        .filter(|encoder| !options.exclude.iter().any(|name| name == names[*encoder]))
        .flat_map(|encoder| [1, 2].map(|order| (encoder, order)))
        .filter_map(|(encoder, order)| lines?.pair(encoder, order))
        .filter(|error| error.log_bayes_factor > LINE_NATS)
        .collect();
    let explained_rad2: f64 = found.iter().map(|error| error.explained_rad2).sum();
    let within_rad2: f64 = runs.iter().map(|run| run.within_rad2).sum();
    let samples: f64 = runs.iter().map(|run| run.samples).sum();
    let points: usize = runs.iter().map(|run| run.points.len()).sum();
    // That part of the samples' scatter which lies inside the stretches goes there.
    let inside = if samples > 0.0 { 1.0 - points as f64 / samples } else { 0.0 };
    for run in runs {
        for point in &mut run.points {
            point.rho_rad -= found.iter().map(|error| error.te_rad(&point.lines)).sum::<f64>();
        }
        let share = if within_rad2 > 0.0 { run.within_rad2 / within_rad2 } else { 0.0 };
        run.within_rad2 = (run.within_rad2 - explained_rad2 * inside * share).max(0.0);
    }
    found
}

/// Sorts by time and joins what is one run in two pieces.
fn join(mut runs: Vec<ReducedRun>) -> Vec<ReducedRun> {
    runs.retain(|run| !run.points.is_empty());
    runs.sort_by(|a, b| a.points[0].time_s.total_cmp(&b.points[0].time_s));
    let mut joined: Vec<ReducedRun> = Vec::new();
    for run in runs {
        let first = run.points[0];
        if let Some(before) = joined.last_mut() {
            let last = before.points[before.points.len() - 1];
            let step = (first.theta1_rad - last.theta1_rad) * run.direction.sign();
            let same = before.direction == run.direction
                && before.speed_rpm == run.speed_rpm
                && (first.load_nm - last.load_nm).abs() <= 0.02 * first.load_nm.abs().max(1e-9);
            // As far apart as neighbouring points of the run are, in angle and in time.
            let speed = (last.theta1_rad - before.points[0].theta1_rad).abs()
                / (last.time_s - before.points[0].time_s).max(1e-9);
            let pause_s = first.time_s - last.time_s;
            if same && step >= 0.0 && step < 0.02 && pause_s * speed < 0.04 {
                before.points.extend(run.points);
                before.within_rad2 += run.within_rad2;
                before.samples += run.samples;
                continue;
            }
        }
        joined.push(run);
    }
    joined
}

/// The state of a diagnosis.
struct Engine<'a> {
    rig: &'a Rig,
    runs: Vec<ReducedRun>,
    grid: Grid,
    pool: Pool,
    options: &'a Options,
    noise: Noise,
    whitened: Whitened,
    best: Option<Model>,
    models: Vec<Model>,
    /// Tones and steps that were found and taken into the pool.
    events: Vec<Pattern>,
}

impl<'a> Engine<'a> {
    fn new(rig: &'a Rig, runs: Vec<ReducedRun>, options: &'a Options) -> Self {
        let grid = Grid::new(rig, &runs);
        let mut pool = Pool::new(&grid);
        let mut causes = Vec::new();
        for (number, effect) in LIBRARY.iter().copied().enumerate() {
            if !effect.applies(rig) || options.exclude.iter().any(|name| name == effect.name()) {
                continue;
            }
            let shapes = effect.shapes(rig, &grid.plan);
            // Neighbouring shapes are alike: they count as fewer.
            let cost_nats = 0.8 * (shapes.len().max(1) as f64).ln();
            causes.extend(shapes.into_iter().map(|shape| Cause::Effect { effect, number, shape, cost_nats }));
        }
        causes.extend(Pattern::all(&grid.plan).into_iter().map(Cause::Unknown));
        pool.add(&grid, rig, causes);
        let noise = Noise::estimate(&grid, &pool, &[]);
        let whitened = Whitened { gram: nalgebra::DMatrix::zeros(0, 0), log_det: 0.0 };
        Self { rig, runs, grid, pool, options, noise, whitened, best: None, models: Vec::new(), events: Vec::new() }
    }

    /// Search, look for events, sharpen, estimate the noise anew, until nothing changes.
    fn solve(&mut self) {
        let t0 = std::time::Instant::now();
        for round in 0..ROUNDS {
            if std::env::var("GAP_TRACE").is_ok() { eprintln!("t {:?}", t0.elapsed()); }
            self.search(false);
            if std::env::var("GAP_TRACE").is_ok() { eprintln!("searched {:?}", t0.elapsed()); }
            let changed = self.sharpen() | self.look_for_events();
            let before = self.noise.floor_rad2();
            self.estimate_noise();
            let moved = (self.noise.floor_rad2() / before).ln().abs();
            if round > 0 && !changed && moved < 0.03 {
                break;
            }
        }
        self.search(true);
    }

    fn estimate_noise(&mut self) {
        let amplitudes = self.best.as_ref().map(|m| m.fit.amplitudes()).unwrap_or_default();
        let ratio = self.noise.run_ratio;
        self.noise = Noise::estimate(&self.grid, &self.pool, &amplitudes);
        self.noise.run_ratio = ratio;
        self.choose_run_ratio();
    }

    /// Searches under the present noise, from nothing and from the last best model.
    fn search(&mut self, last: bool) {
        let start = self.best.as_ref().map(|m| m.fit.set.clone());
        self.whitened = self.noise.whiten(&self.grid, &self.pool);
        let mut search = Search::new(&self.pool, &self.whitened, &self.options.known);
        let mut best = search.run();
        if let Some(set) = start
            && let Some(other) = search.climb(set, true)
            && best.as_ref().is_none_or(|b| other.score > b.score)
        {
            best = Some(other);
        }
        if last {
            if let Some(model) = &best {
                search.explore(model);
            }
            self.models = search.models();
            best = self.models.first().cloned();
        }
        self.best = best;
        if std::env::var("GAP_TRACE").is_ok() {
            let mut search = Search::new(&self.pool, &self.whitened, &self.options.known);
            let empty = search.model(Vec::new(), None).map_or(0.0, |m| m.score);
            if let Some(model) = &self.best {
                eprintln!("places {} revs {} blocks {} cols {} white {:.2} ratio {:?} orders {:?}", self.grid.places.len(), self.grid.revolutions.len(), self.pool.blocks.len(), self.pool.width(), 1e6*self.noise.white_rad2.sqrt(), self.noise.run_ratio, self.noise.order_rad2.map(|v| (1e8*v.sqrt()).round()/100.0));
                let names: Vec<String> = model.fit.set.iter().enumerate().map(|(n, b)| { let place = model.fit.place(&self.pool, n); let rms = 1e6*model.fit.mean.rows(place.start, place.len()).norm(); match &self.pool.blocks[*b].cause { Cause::Effect { effect, shape, .. } => format!("{} {:?} {rms:.1}", effect.name(), if shape.len() > 6 { vec![shape.len() as f64] } else { shape.clone() }), Cause::Unknown(p) => format!("{} {rms:.1}", p.describe()) } }).collect();
                eprintln!("   gain {:.1}: {names:?}", model.score - empty);
            }
        }
    }

    /// The scatter between runs that the best model leaves, weighed on a grid.
    fn choose_run_ratio(&mut self) {
        let Some(best) = &self.best else { return };
        if self.grid.plan.runs < 2 {
            return;
        }
        let mut chosen = (f64::NEG_INFINITY, self.noise.run_ratio);
        for level in RUN_RATIOS {
            for waves in RUN_RATIOS {
                let mut noise = self.noise.clone();
                noise.run_ratio = [level, waves];
                let mut columns = vec![evidence::RESIDUAL];
                columns.extend(&best.fit.columns);
                let whitened = noise.whiten_runs(&self.grid, &self.pool, Some(&columns));
                let log_prior: f64 = [level, waves]
                    .iter()
                    .zip(FIRST_RUN_RATIO)
                    .map(|(ratio, usual)| -0.5 * ((ratio / usual).ln() / RUN_RATIO_SPREAD).powi(2))
                    .sum();
                let score = evidence::at_scales(&self.pool, &whitened, &best.fit) + log_prior;
                if score > chosen.0 {
                    chosen = (score, noise.run_ratio);
                }
            }
        }
        self.noise.run_ratio = chosen.1;
    }

    /// Adds shapes about those of the best model, and keeps them where they fit better.
    fn sharpen(&mut self) -> bool {
        let Some(best) = self.best.clone() else { return false };
        let mut causes = Vec::new();
        for (n, b) in best.fit.set.iter().enumerate() {
            let block = &self.pool.blocks[*b];
            let Cause::Effect { effect, number, shape, cost_nats } = &block.cause else { continue };
            let (effect, number, cost_nats) = (*effect, *number, *cost_nats);
            let mut shapes = effect.neighbours(shape);
            if let Some(refined) = effect.refine(self.rig, shape, &self.raw(&best, n).beta) {
                shapes.push(refined);
            }
            for shape in shapes {
                let known = self.pool.blocks.iter().any(
                    |b| matches!(&b.cause, Cause::Effect { number: m, shape: s, .. } if *m == number && *s == shape),
                );
                if !known {
                    causes.push(Cause::Effect { effect, number, shape, cost_nats });
                }
            }
        }
        if causes.is_empty() {
            return false;
        }
        self.pool.add(&self.grid, self.rig, causes);
        true
    }

    fn look_for_events(&mut self) -> bool {
        let amplitudes = self.best.as_ref().map(|m| m.fit.amplitudes()).unwrap_or_default();
        let found = events::find(&self.grid, &self.runs, &self.pool, &self.noise, &amplitudes);
        let mut causes = Vec::new();
        for pattern in found.patterns {
            if !self.events.contains(&pattern) {
                self.events.push(pattern.clone());
                causes.push(Cause::Unknown(pattern));
            }
        }
        let allowed = !self.options.exclude.iter().any(|name| name == "count_loss");
        let count_loss = LIBRARY.iter().copied().enumerate().find(|(_, e)| e.name() == "count_loss");
        if let Some((number, effect)) = count_loss.filter(|_| allowed) {
            for times_s in found.steps {
                let known = self.pool.blocks.iter().any(
                    |b| matches!(&b.cause, Cause::Effect { number: m, shape: s, .. } if *m == number && *s == times_s),
                );
                if !known {
                    let cost_nats = events::STEP_NATS * times_s.len() as f64;
                    causes.push(Cause::Effect { effect, number, shape: times_s, cost_nats });
                }
            }
        }
        let changed = !causes.is_empty();
        self.pool.add(&self.grid, self.rig, causes);
        changed
    }

    /// Amplitudes of block `n` of a model in the effect's own units.
    fn raw(&self, model: &Model, n: usize) -> Estimate {
        let block = &self.pool.blocks[model.fit.set[n]];
        let place = model.fit.place(&self.pool, n);
        let mean = model.fit.mean.rows(place.start, place.len());
        let covariance = model.fit.covariance.view((place.start, place.start), (place.len(), place.len()));
        Estimate {
            beta: (&block.transform * mean).iter().copied().collect(),
            covariance: &block.transform * covariance * block.transform.transpose(),
        }
    }
}

#[path = "report.rs"]
mod report;
