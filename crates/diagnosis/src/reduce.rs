//! Samples → points: one pass that averages the residual over short segments of the driver's turn.
//!
//! The residual ρ = (θ2 − f(θ1)) − TE_nominal(θ1, sense, load) is averaged over segments of a quarter degree, so that
//! everything after is independent of the log's length. Nothing is lost to a faster sampling than that but what averages
//! out in a segment, the encoders' line phase, which is collected beside ([`LinePhase`]).

use super::line_phase::LinePhase;
use super::nominal::Nominal;
use super::settings::Settings;
use gearmodel::Direction;
use gearmodel::effect::{OperatingPoint, Term};

/// A segment: mean values of its samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Point {
    /// Time, s.
    pub time_s: f64,
    /// Driver angle, rad.
    pub theta1_rad: f64,
    /// Driven angle, rad.
    pub theta2_rad: f64,
    /// Residual, rad.
    pub rho_rad: f64,
    /// Load, N·m.
    pub load_nm: f64,
    /// Variance of the samples' driver angle, rad².
    pub spread_rad2: f64,
    /// Samples.
    pub samples: f64,
    /// Mean of the encoders' line waves as TE shows them.
    pub lines: [f64; super::line_phase::WAVES],
}

/// A run reduced to points.
#[derive(Clone, Debug)]
pub struct ReducedRun {
    /// Driving sense.
    pub direction: Direction,
    /// Nominal speed, rpm; 0 where unknown.
    pub speed_rpm: f64,
    /// Points in order of time.
    pub points: Vec<Point>,
    /// Sum of squared deviations of the samples' residual from their point's mean, rad².
    pub within_rad2: f64,
    /// Samples used.
    pub samples: f64,
}

/// A sample of both encoders.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// Driver angle, rad.
    pub theta1_rad: f64,
    /// Driven angle, rad.
    pub theta2_rad: f64,
    /// Load, N·m.
    pub load_nm: f64,
}

/// Takes the samples of one run in order of time.
pub struct Reducer<'a> {
    nominal: &'a Nominal,
    run: ReducedRun,
    segment_rad: f64,
    segment: Segment,
    lines: LinePhase,
    documented_lines: Vec<&'a Term>,
}

/// The segment being filled, with the pair's kinematics at its first sample.
#[derive(Clone, Copy, Debug, Default)]
struct Segment {
    origin: Point,
    ratio: f64,
    ratio_slope: f64,
    theta2_rad: f64,
    sum: Point,
    squares: f64,
}

impl<'a> Reducer<'a> {
    /// Begins a run.
    #[must_use]
    pub fn new(nominal: &'a Nominal, direction: Direction, speed_rpm: f64, settings: &Settings) -> Self {
        let run = ReducedRun { direction, speed_rpm, points: Vec::new(), within_rad2: 0.0, samples: 0.0 };
        let lines = LinePhase::new(nominal.rig().lines, &settings.lines);
        Self {
            nominal,
            run,
            segment_rad: settings.reduction.segment_rad,
            segment: Segment::default(),
            lines,
            documented_lines: nominal.line_errors().collect(),
        }
    }

    /// Takes a sample; one with a gap (NaN) is skipped.
    pub fn push(&mut self, sample: Sample) {
        if !(sample.theta1_rad.is_finite() && sample.theta2_rad.is_finite()) {
            return;
        }
        let filled = self.segment.sum.samples > 0.0;
        if !filled || (sample.theta1_rad - self.segment.origin.theta1_rad).abs() >= self.segment_rad {
            if filled {
                self.close();
            }
            let at = self.nominal.rig().pair().at(sample.theta1_rad);
            self.segment = Segment {
                origin: Point { theta1_rad: sample.theta1_rad, time_s: sample.time_s, ..Point::default() },
                ratio: at.ratio,
                ratio_slope: at.mu_rad.tan() * at.ratio * (1.0 + at.ratio),
                theta2_rad: at.theta2_rad,
                sum: Point::default(),
                squares: 0.0,
            };
        }
        let segment = &mut self.segment;
        // f about the segment's start to second order; a quarter degree leaves 0.05 µrad.
        let step = sample.theta1_rad - segment.origin.theta1_rad;
        let f_rad = segment.theta2_rad + step * (segment.ratio + 0.5 * segment.ratio_slope * step);
        let mut deviation = sample.theta2_rad - f_rad;
        if !self.documented_lines.is_empty() {
            let (theta1_rad, theta2_rad) = (sample.theta1_rad, sample.theta2_rad);
            let at = OperatingPoint { theta1_rad, theta2_rad, ratio: segment.ratio, ..OperatingPoint::default() };
            let rig = self.nominal.rig();
            deviation -= self.documented_lines.iter().map(|term| term.te_rad(rig, &at)).sum::<f64>();
        }
        segment.sum.time_s += sample.time_s - segment.origin.time_s;
        segment.sum.theta1_rad += step;
        segment.sum.spread_rad2 += step * step;
        segment.sum.theta2_rad += f_rad - segment.theta2_rad;
        segment.sum.rho_rad += deviation;
        segment.sum.load_nm += sample.load_nm;
        segment.sum.samples += 1.0;
        segment.squares += deviation * deviation;
        let waves = self.lines.push(sample.theta1_rad, sample.theta2_rad, segment.ratio, deviation);
        segment.sum.lines.iter_mut().zip(waves).for_each(|(sum, x)| *sum += x);
    }

    fn close(&mut self) {
        let Segment { origin, theta2_rad, sum, squares, .. } = self.segment;
        let n = sum.samples;
        let mean = sum.rho_rad / n;
        let step = sum.theta1_rad / n;
        let theta1_rad = origin.theta1_rad + step;
        let load_nm = sum.load_nm / n;
        self.run.points.push(Point {
            time_s: origin.time_s + sum.time_s / n,
            theta1_rad,
            theta2_rad: theta2_rad + sum.theta2_rad / n,
            rho_rad: mean - self.nominal.te_rad(theta1_rad, self.run.direction, load_nm),
            load_nm,
            spread_rad2: (sum.spread_rad2 / n - step * step).max(0.0),
            samples: n,
            lines: sum.lines.map(|x| x / n),
        });
        self.run.within_rad2 += (squares - n * mean * mean).max(0.0);
        self.run.samples += n;
    }

    /// The run as points, and what was seen of the encoders' lines.
    #[must_use]
    pub fn finish(mut self) -> (ReducedRun, LinePhase) {
        if self.segment.sum.samples > 0.0 {
            self.close();
        }
        self.lines.flush();
        (self.run, self.lines)
    }
}
