//! The diagnosis from recordings to answer: each step in its own file, here in order.

use rayon::prelude::*;

use super::design_matrix::{Candidate, DesignMatrix};
use super::diagnosis::{Confusability, Diagnosis, EffectFinding, Group, Unknown, UnknownLocation, Verdict};
use super::events::Tone;
use super::grid::Grid;
use super::line_phase::{LineError, LinePhase};
use super::noise::{FIRST_RUN_RATIO, Noise, Whitened};
use super::nominal::Nominal;
use super::nuisance_patterns::Pattern;
use super::posterior::{self, Posterior, confusable};
use super::reduce::{ReducedRun, Reducer, Sample};
use super::search::{Allowed, Model, Search};
use super::transients::Transients;
use super::{
    cross_validation, events, evidence, experiment_design, ghosts, interpolation, localisation, sectors, slow_tone,
    transients,
};
use gearmodel::effect::predict::{Found, FoundEffect};
use gearmodel::effect::{Accumulates, Carrier, Effect, Estimate, INTERPOLATION, LIBRARY, Rig, by_name};
use gearmodel::recording::Recording;
use gearmodel::{Direction, NominalModel};

/// Ratios of the scatter between runs to that between revolutions that are weighed against one another.
const RUN_RATIOS: [f64; 6] = [0.02, 0.08, 0.3, 1.0, 3.0, 10.0];
/// How far such a ratio usually is from what it is first taken to be: a factor of e to this.
const RUN_RATIO_SPREAD: f64 = 1.5;
/// Blocks smaller than this part of the largest are left out while its shape is moved.
const LARGE: f64 = 0.12;
/// Steps in which shapes are moved, in parts of their grid's.
const SHARPENING_STEPS: [f64; 6] = [1.0, 0.6, 0.3, 0.15, 0.07, 0.03];
/// What a moved shape must gain, nats: a fifth of its standard deviation.
const SHARPER_NATS: f64 = 0.02;
/// Rounds of: search, look for events, sharpen shapes, estimate the noise anew.
const ROUNDS: usize = 3;
/// Log Bayes factor from which a sub-divisional error is taken off.
const LINE_NATS: f64 = 4.0;
/// Part of the knocks' RMS that may be left under the scatter where they ring on.
const TAILS: f64 = 0.12;
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
    /// Recordings without a segment in which the driver turns.
    #[error(
        "{recordings} recordings hold {points} segments of motion together: at least {needed} are needed (a quarter degree each)"
    )]
    TooShort {
        /// Recordings given.
        recordings: usize,
        /// Segments found.
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
    let mut nominal = Nominal::new(Rig::new(model.clone(), lines, quantum));
    let parts: Vec<Recording<'_>> = recordings.iter().flat_map(Recording::split).collect();
    let lines = interpolation::search_lines(&parts, &nominal, lines);
    nominal.set_lines(lines);
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
    let mut grid = Grid::new(nominal.rig(), &runs);
    let transients = transients::take_off(&grid, &mut runs);
    if transients.is_some() {
        grid = Grid::new(nominal.rig(), &runs);
    }
    let (tones, grid) = events::take_off_tones(nominal.rig(), &mut runs, grid);
    let mut engine = Engine::new(nominal.rig(), grid, Aside { tones, transients }, options);
    engine.solve();
    engine.report(&found_lines).ok_or(GapError::Singular)
}

/// Finds sub-divisional errors and takes them off the points, so that they are no noise for the rest.
fn take_off_lines(runs: &mut [ReducedRun], lines: Option<&LinePhase>, options: &Options) -> Vec<LineError> {
    let mut found: Vec<LineError> = Vec::new();
    if let Some(lines) = lines {
        // The strongest first, and each judged on what the others leave.
        let mut left = lines.clone();
        let open: Vec<(usize, usize)> = (0..2)
            .filter(|encoder| !options.exclude.iter().any(|name| name == INTERPOLATION[*encoder]))
            .flat_map(|encoder| [1, 2].map(|order| (encoder, order)))
            .collect();
        while let Some(error) = open
            .iter()
            .filter(|(encoder, order)| !found.iter().any(|f| f.encoder == *encoder && f.order == *order))
            .filter_map(|(encoder, order)| left.pair(*encoder, *order))
            .max_by(|a, b| a.log_bayes_factor.total_cmp(&b.log_bayes_factor))
            .filter(|error| error.log_bayes_factor > LINE_NATS)
        {
            left.take_off(&error);
            found.push(error);
        }
    }
    let explained_rad2: f64 = found.iter().map(|error| error.explained_rad2).sum();
    let within_rad2: f64 = runs.iter().map(|run| run.within_rad2).sum();
    let samples: f64 = runs.iter().map(|run| run.samples).sum();
    let points: usize = runs.iter().map(|run| run.points.len()).sum();
    // That part of the samples' scatter which lies inside the segments goes there.
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
            if same && (0.0..0.02).contains(&step) && pause_s * speed < 0.04 {
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

/// What was taken off the points before anything was fitted.
struct Aside {
    tones: Vec<Tone>,
    transients: Option<Transients>,
}

impl Aside {
    /// Mean square of the tones, rad².
    fn tones_rad2(&self) -> f64 {
        self.tones.iter().map(|tone| 0.5 * tone.amplitude_rad * tone.amplitude_rad).sum()
    }

    /// Its mean square, rad².
    fn mean_square_rad2(&self) -> f64 {
        self.tones_rad2() + self.transients.map_or(0.0, |transients| transients.mean_square_rad2)
    }

    /// RMS below which nothing is told from the tails of the knocks, rad.
    fn least_rad(&self) -> f64 {
        self.transients.map_or(0.0, |transients| TAILS * transients.mean_square_rad2.sqrt())
    }

    fn is_empty(&self) -> bool {
        self.tones.is_empty() && self.transients.is_none()
    }
}

/// The state of a diagnosis.
struct Engine<'a> {
    rig: &'a Rig,
    aside: Aside,
    grid: Grid,
    design: DesignMatrix,
    options: &'a Options,
    noise: Noise,
    whitened: Whitened,
    best: Option<Model>,
    models: Vec<Model>,
    /// The larger blocks with their shapes moved to where they fit best: a start for the next search.
    large: Option<Vec<usize>>,
}

impl<'a> Engine<'a> {
    fn new(rig: &'a Rig, grid: Grid, aside: Aside, options: &'a Options) -> Self {
        let mut design = DesignMatrix::new(&grid);
        let mut candidates = Vec::new();
        for (number, effect) in LIBRARY.iter().copied().enumerate() {
            if !effect.applies(rig) || options.exclude.iter().any(|name| name == effect.name()) {
                continue;
            }
            let shapes = effect.shapes(rig, &grid.plan);
            // Neighbouring shapes are alike: they count as fewer.
            let cost_nats = 0.8 * (shapes.len().max(1) as f64).ln();
            candidates.extend(shapes.into_iter().map(|shape| Candidate::Effect { effect, number, shape, cost_nats }));
        }
        candidates.extend(Pattern::all(&grid.plan).into_iter().map(Candidate::Unknown));
        design.add(&grid, rig, &candidates);
        let noise = Noise::estimate(&grid, &design, &[]);
        let ghosts = ghosts::find(&grid, &noise, &grid.rho_rad);
        design.add(&grid, rig, &ghosts.into_iter().map(Candidate::Unknown).collect::<Vec<_>>());
        let whitened = Whitened::empty();
        Self { rig, aside, grid, design, options, noise, whitened, best: None, models: Vec::new(), large: None }
    }

    /// Search, look for events, sharpen, estimate the noise anew, until nothing changes.
    fn solve(&mut self) {
        for round in 0..ROUNDS {
            self.search(false);
            let changed = self.sharpen()
                | self.look_for_events()
                | (round == 0 && self.look_for_what_runs_on())
                | (round == 0 && self.look_for_wandering_waves());
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
        self.noise = Noise::estimate(&self.grid, &self.design, &amplitudes);
        self.noise.run_ratio = ratio;
        if let Some(best) = &self.best {
            self.noise.run_ratio = self.best_run_ratio(&self.noise, &self.design, &best.fit);
        }
    }

    /// Searches under the present noise, from nothing and from the last best model.
    fn search(&mut self, last: bool) {
        let starts: Vec<Vec<usize>> =
            self.best.as_ref().map(|m| m.fit.set.clone()).into_iter().chain(self.large.take()).collect();
        self.whitened = self.noise.whiten(&self.grid, &self.design);
        let mut search = self.search_in(&self.design, &self.whitened);
        let mut best = search.run();
        for set in starts {
            if let Some(other) = search.climb(set, Allowed::All)
                && best.as_ref().is_none_or(|b| other.score > b.score)
            {
                best = Some(other);
            }
        }
        if last {
            if let Some(model) = &best {
                search.explore(model);
            }
            self.models = search.models();
            best = self.models.first().cloned();
        }
        self.best = best;
    }

    /// A search in a design matrix under one noise, with what is known and what was cut out.
    fn search_in<'b>(&self, design: &'b DesignMatrix, whitened: &'b Whitened) -> Search<'b> {
        Search::new(design, whitened, &self.options.known, self.aside.least_rad())
    }

    /// The scatter between runs that a fit leaves, weighed on a grid.
    fn best_run_ratio(&self, noise: &Noise, design: &DesignMatrix, fit: &evidence::Fit) -> [f64; 2] {
        if self.grid.plan.runs < 2 {
            return noise.run_ratio;
        }
        let mut columns = vec![super::design_matrix::RESIDUAL];
        columns.extend(&fit.columns);
        let mut chosen = (f64::NEG_INFINITY, noise.run_ratio);
        let within = noise.within_runs(&self.grid, design, Some(&columns));
        for level in RUN_RATIOS {
            for waves in RUN_RATIOS {
                let ratio = [level, waves];
                let whitened = within.between_runs(ratio);
                let log_prior: f64 = ratio
                    .iter()
                    .zip(FIRST_RUN_RATIO)
                    .map(|(ratio, usual)| -0.5 * ((ratio / usual).ln() / RUN_RATIO_SPREAD).powi(2))
                    .sum();
                let score = evidence::at_scales(design, &whitened, fit) + log_prior;
                if score > chosen.0 {
                    chosen = (score, ratio);
                }
            }
        }
        chosen.1
    }

    /// Moves the shapes of the best model's larger effects to where they fit best, the small ones left out: what a shape on
    /// a grid misses must not be made up by other effects. Then both sets compete. Works in a design matrix of its own, which stays
    /// small.
    fn sharpen(&mut self) -> bool {
        let Some(best) = &self.best else { return false };
        let largest = (0..best.fit.set.len()).map(|n| best.fit.rms_rad(&self.design, n)).fold(0.0, f64::max);
        let large: Vec<usize> = (0..best.fit.set.len())
            .filter(|n| best.fit.rms_rad(&self.design, *n) > LARGE * largest)
            .map(|n| best.fit.set[n])
            .collect();
        let mut few = self.design.only(&self.grid, &large);
        let mut changed = false;
        for step in SHARPENING_STEPS {
            let mut moved = false;
            for _ in 0..large.len() {
                moved |= self.sharpen_first(&mut few, step);
            }
            changed |= moved;
            if !moved && step < 0.2 {
                break;
            }
        }
        if changed {
            let shaped: Vec<Candidate> = few.blocks.into_iter().map(|block| block.candidate).collect();
            let known: Vec<Option<usize>> = shaped.iter().map(|candidate| self.block_of(candidate)).collect();
            let fresh: Vec<Candidate> =
                shaped.into_iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(candidate, _)| candidate).collect();
            let mut added = self.design.add(&self.grid, self.rig, &fresh).into_iter();
            self.large = Some(known.into_iter().filter_map(|k| k.or_else(|| added.next())).collect());
        }
        changed
    }

    /// Block of the design matrix with the same candidate.
    fn block_of(&self, candidate: &Candidate) -> Option<usize> {
        self.design.blocks.iter().position(|block| match (&block.candidate, candidate) {
            (Candidate::Unknown(a), Candidate::Unknown(b)) => a == b,
            (Candidate::Effect { number: m, shape: a, .. }, Candidate::Effect { number: n, shape: b, .. }) => {
                m == n && a == b
            }
            _ => false,
        })
    }

    /// Tries the shapes about that of a design matrix's first block, and puts the best behind the others; true where that is another.
    fn sharpen_first(&self, few: &mut DesignMatrix, step: f64) -> bool {
        let all: Vec<usize> = (0..few.blocks.len()).collect();
        let whitened = self.noise.whiten(&self.grid, few);
        let Some(now) = evidence::fit(few, &whitened, &all, &[]) else { return false };
        let fresh: Vec<Candidate> = match few.blocks[0].candidate.clone() {
            Candidate::Effect { effect, number, shape, cost_nats } => {
                let refined = effect.refine(self.rig, &shape, &amplitudes_of(few, &whitened, &now, 0).beta);
                let shapes = effect.neighbours(&shape, step).into_iter().chain(refined);
                shapes.map(|shape| Candidate::Effect { effect, number, shape, cost_nats }).collect()
            }
            Candidate::Unknown(pattern) => {
                let nearer = pattern.nearer(step, self.grid.span_rev());
                nearer.into_iter().map(Candidate::Unknown).collect()
            }
        };
        let others = few.only(&self.grid, &all[1..]);
        let start_rad: Vec<f64> = now.scales_rad[1..].iter().chain(&now.scales_rad[..1]).copied().collect();
        let best = fresh
            .into_par_iter()
            .filter_map(|candidate| {
                let mut tried = others.clone();
                tried.add(&self.grid, self.rig, &[candidate]).first()?;
                let fit = evidence::fit(&tried, &self.noise.whiten(&self.grid, &tried), &all, &start_rad)?;
                Some((fit.log_evidence, tried))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(log_evidence, _)| *log_evidence > now.log_evidence + SHARPER_NATS);
        let moved = best.is_some();
        *few = best.map_or_else(|| few.only(&self.grid, &[&all[1..], &all[..1]].concat()), |(_, tried)| tried);
        moved
    }

    /// Amplitudes of block `n` of a model in the effect's own units.
    fn raw(&self, model: &Model, n: usize) -> Estimate {
        amplitudes_of(&self.design, &self.whitened, &model.fit, n)
    }
}

/// Amplitudes of block `n` of a fit in the effect's own units.
fn amplitudes_of(design: &DesignMatrix, whitened: &Whitened, fit: &evidence::Fit, n: usize) -> Estimate {
    let block = &design.blocks[fit.set[n]];
    let place = fit.place(design, n);
    let mean = fit.mean.rows(place.start, place.len());
    let covariance = evidence::covariance(design, whitened, fit);
    let covariance = covariance.view((place.start, place.start), (place.len(), place.len()));
    Estimate {
        beta: (&block.transform * mean).iter().copied().collect(),
        covariance: &block.transform * covariance * block.transform.transpose(),
    }
}

#[path = "nonstationary.rs"]
mod nonstationary;
#[path = "report.rs"]
mod report;
