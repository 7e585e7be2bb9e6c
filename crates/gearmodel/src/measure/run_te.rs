//! TE of one run over angle bins and revolutions, sample by sample.

use super::grid::{AngleGrid, Curve, mean};
use crate::{Direction, GearPair};

/// Set-points of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunConditions {
    /// The driver's sense of rotation.
    pub direction: Direction,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Driver speed, rpm, positive in both senses.
    pub speed_rpm: f64,
}

/// The first raw sample past a bin's edge, neither averaged nor interpolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TePoint {
    /// Bin of θ1, or of θ2 where the bins are the driven shaft's, 0..bins.
    pub bin: usize,
    /// Revolution of the run, counted up from 0 in both senses.
    pub revolution: i32,
    /// θ1 of the sample, rad, unwrapped.
    pub theta1_rad: f64,
    /// θ2 of the sample, rad, unwrapped.
    pub theta2_rad: f64,
    /// θ2 − f(θ1), rad; no zero is subtracted.
    pub te_rad: f64,
}

/// Beyond this angle (some 160 million turns) θ1 no longer resolves a bin well, and no encoder counts that far.
const MAX_ANGLE_RAD: f64 = 1e9;

/// Sums over the samples of one bin in one revolution.
#[derive(Clone, Copy, Debug, Default)]
struct BinSum {
    count: u32,
    /// Σ (angle − bin centre), rad.
    offset_rad: f64,
    /// Σ (TE − the run's first TE), rad: the subtraction keeps the sums short when the zero is far off.
    te_rad: f64,
}

#[derive(Clone, Debug)]
struct Revolution {
    number: i32,
    bins: Box<[BinSum]>,
}

/// TE of a run: feed raw samples with [`RunTe::push`], read curves at any time.
///
/// Revolutions are counted in whole turns of bins from the bin of the run's first sample, so a revolution holds every bin
/// once; revolution 0 starts at the first sample.
#[derive(Clone, Debug)]
pub struct RunTe {
    grid: AngleGrid,
    conditions: RunConditions,
    samples: u64,
    rejected: u64,
    te_origin_rad: f64,
    first_bin: i64,
    /// Unwrapped bin of the last sample, its wrapped bin and where its sums are: the hot path stays here.
    last_bin: i64,
    last_wrapped: usize,
    last_revolution: usize,
    /// Furthest unwrapped bin in the sense of motion: points are emitted only beyond it.
    furthest_bin: i64,
    revolutions: Vec<Revolution>,
    points: Vec<TePoint>,
}

impl RunTe {
    /// An empty run.
    #[must_use]
    pub fn new(grid: AngleGrid, conditions: RunConditions) -> Self {
        Self {
            grid,
            conditions,
            samples: 0,
            rejected: 0,
            te_origin_rad: 0.0,
            first_bin: 0,
            last_bin: i64::MIN,
            last_wrapped: 0,
            last_revolution: 0,
            furthest_bin: 0,
            revolutions: Vec::new(),
            points: Vec::new(),
        }
    }

    /// Takes one sample of unwrapped angles, rad. Returns the point when this is the first sample in a bin that the run had
    /// not reached before; swinging back over an edge opens no bin a second time.
    ///
    /// A sample that is not finite, or beyond 10⁹ rad, is counted in [`RunTe::rejected`] and otherwise ignored.
    #[inline]
    pub fn push(&mut self, pair: &GearPair, theta1_rad: f64, theta2_rad: f64) -> Option<TePoint> {
        self.take(theta1_rad, pair, theta1_rad, theta2_rad)
    }

    /// [`RunTe::push`] with bins and revolutions of the driven shaft: the angle of the bins is θ2, so that what turns with
    /// the driven shaft stays and everything else averages out. A run is fed by one of the two.
    #[inline]
    pub fn push_over_driven(&mut self, pair: &GearPair, theta1_rad: f64, theta2_rad: f64) -> Option<TePoint> {
        self.take(theta2_rad, pair, theta1_rad, theta2_rad)
    }

    #[inline]
    fn take(&mut self, angle_rad: f64, pair: &GearPair, theta1_rad: f64, theta2_rad: f64) -> Option<TePoint> {
        let te_rad = theta2_rad - pair.theta2(theta1_rad);
        if !te_rad.is_finite() || theta1_rad.abs() > MAX_ANGLE_RAD || angle_rad.abs() > MAX_ANGLE_RAD {
            self.rejected += 1;
            return None;
        }
        self.samples += 1;
        let bin = self.grid.unwrapped_bin_of(angle_rad);
        let opened = if bin == self.last_bin { None } else { self.enter(bin, theta1_rad, theta2_rad, te_rad) };
        let centre_rad = (bin as f64 + 0.5) * self.grid.width_rad();
        let sum = &mut self.revolutions[self.last_revolution].bins[self.last_wrapped];
        sum.count += 1;
        sum.offset_rad += angle_rad - centre_rad;
        sum.te_rad += te_rad - self.te_origin_rad;
        opened
    }

    /// Moves on to another bin than that of the last sample.
    fn enter(&mut self, bin: i64, theta1_rad: f64, theta2_rad: f64, te_rad: f64) -> Option<TePoint> {
        let sense = if self.conditions.direction == Direction::Ccw { 1 } else { -1 };
        let is_first = self.revolutions.is_empty();
        if is_first {
            self.te_origin_rad = te_rad;
            self.first_bin = bin;
        }
        let travelled = bin.saturating_sub(self.first_bin).saturating_mul(sense);
        // A swing back over the start belongs to the first revolution, not to one before it.
        let number = (travelled / self.grid.bins() as i64).clamp(0, i64::from(i32::MAX)) as i32;
        self.last_bin = bin;
        self.last_wrapped = self.grid.wrap(bin);
        self.last_revolution = self.revolution_slot(number);
        if !is_first && travelled <= self.furthest_bin {
            return None;
        }
        self.furthest_bin = travelled;
        let point = TePoint { bin: self.last_wrapped, revolution: number, theta1_rad, theta2_rad, te_rad };
        self.points.push(point);
        Some(point)
    }

    /// Index of a revolution's sums, made when it is new.
    fn revolution_slot(&mut self, number: i32) -> usize {
        match self.revolutions.binary_search_by_key(&number, |revolution| revolution.number) {
            Ok(slot) => slot,
            Err(slot) => {
                let bins = vec![BinSum::default(); self.grid.bins()].into_boxed_slice();
                self.revolutions.insert(slot, Revolution { number, bins });
                slot
            }
        }
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> AngleGrid {
        self.grid
    }

    /// The set-points.
    #[must_use]
    pub fn conditions(&self) -> RunConditions {
        self.conditions
    }

    /// Samples taken.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples refused by [`RunTe::push`].
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whole revolutions: those whose last bin the run has reached.
    #[must_use]
    pub fn revolutions(&self) -> usize {
        if self.revolutions.is_empty() { 0 } else { (self.furthest_bin as usize + 1) / self.grid.bins() }
    }

    /// All points emitted so far, in order.
    #[must_use]
    pub fn te_points(&self) -> &[TePoint] {
        &self.points
    }

    /// TE over one revolution, rad: bin means at bin centres. A revolution that was not touched is all NaN.
    #[must_use]
    pub fn revolution_curve(&self, revolution: usize) -> Curve {
        let found = i32::try_from(revolution)
            .ok()
            .and_then(|number| self.revolutions.binary_search_by_key(&number, |revolution| revolution.number).ok());
        match found {
            Some(slot) => self.curve_of(&self.revolutions[slot].bins),
            None => Curve { values_rad: vec![f64::NAN; self.grid.bins()] },
        }
    }

    /// The whole revolutions that hold samples, by number, with their curves.
    pub fn whole_revolutions(&self) -> impl Iterator<Item = (usize, Curve)> {
        let whole = self.revolutions();
        self.revolutions.iter().filter_map(move |revolution| {
            let number = usize::try_from(revolution.number).ok().filter(|number| *number < whole)?;
            Some((number, self.curve_of(&revolution.bins)))
        })
    }

    /// TE over one turn, rad: the mean of the whole revolutions, each with equal weight, so that a revolution of more
    /// samples does not pull. A run of less than one revolution gives what there is.
    #[must_use]
    pub fn mean_curve(&self) -> Curve {
        let whole = self.revolutions();
        if whole == 0 {
            let Some(only) = self.revolutions.first() else {
                return self.revolution_curve(0);
            };
            return self.curve_of(&only.bins);
        }
        let curves: Vec<Curve> = self.whole_revolutions().map(|(_, curve)| curve).collect();
        let at_bin = |bin: usize| mean(curves.iter().map(|curve| curve.values_rad[bin]).filter(|v| v.is_finite()));
        Curve { values_rad: (0..self.grid.bins()).map(at_bin).collect() }
    }

    /// Feeds every value of the run's result in order: TE of the points, then the curves of the whole revolutions (NaN as
    /// the one canonical NaN). Equal sequences mean bit-identical results.
    pub fn for_each_hashed_value(&self, feed: &mut dyn FnMut(f64)) {
        for point in &self.points {
            feed(point.te_rad);
        }
        for (_, curve) in self.whole_revolutions() {
            for value in curve.values_rad {
                feed(if value.is_nan() { f64::NAN } else { value });
            }
        }
    }

    /// Bin means moved to the bin centres.
    ///
    /// Samples need not cover a bin evenly (its first and last bin, few samples a bin, a speed ripple), so the plain mean
    /// belongs to the samples' mean angle. It is moved to the centre with the slope between the neighbouring bins' mean
    /// points, which removes the bias to first order; a lone bin stays as it is.
    fn curve_of(&self, sums: &[BinSum]) -> Curve {
        let width_rad = self.grid.width_rad();
        // (mean angle from the bin's own centre, mean TE)
        let means: Vec<Option<(f64, f64)>> = sums
            .iter()
            .map(|sum| {
                let count = f64::from(sum.count);
                (sum.count > 0).then(|| (sum.offset_rad / count, sum.te_rad / count))
            })
            .collect();
        let last = means.len() - 1;
        let value = |bin: usize| {
            let Some((offset_rad, te_rad)) = means[bin] else {
                return f64::NAN;
            };
            let before = means[if bin == 0 { last } else { bin - 1 }].map(|(x, te)| (x - width_rad, te));
            let after = means[if bin == last { 0 } else { bin + 1 }].map(|(x, te)| (x + width_rad, te));
            let (from, to) = match (before, after) {
                (Some(before), Some(after)) => (before, after),
                (Some(before), None) => (before, (offset_rad, te_rad)),
                (None, Some(after)) => ((offset_rad, te_rad), after),
                (None, None) => return self.te_origin_rad + te_rad,
            };
            // Neighbouring means are at least apart by what their bins allow; a vanishing distance has no slope to give.
            let distance_rad = to.0 - from.0;
            let slope = if distance_rad > 1e-3 * width_rad { (to.1 - from.1) / distance_rad } else { 0.0 };
            self.te_origin_rad + te_rad - slope * offset_rad
        };
        Curve { values_rad: (0..means.len()).map(value).collect() }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::EllipticalSpec;

    fn conditions(direction: Direction) -> RunConditions {
        RunConditions { direction, load_nm: 10.0, speed_rpm: 5.0 }
    }

    fn pair() -> GearPair {
        GearPair::elliptical(&EllipticalSpec::default()).unwrap()
    }

    /// A run of `revolutions` from `start`, `per_turn` samples a turn, with TE given by a function of θ1.
    fn run(direction: Direction, start: f64, revolutions: f64, per_turn: u32, te: impl Fn(f64) -> f64) -> RunTe {
        let pair = pair();
        let mut run = RunTe::new(AngleGrid::default(), conditions(direction));
        let count = (revolutions * f64::from(per_turn)) as u32;
        for n in 0..count {
            let theta1 = start + direction.sign() * TAU * f64::from(n) / f64::from(per_turn);
            run.push(&pair, theta1, pair.theta2(theta1) + te(theta1));
        }
        run
    }

    #[test]
    fn curves_recover_a_smooth_te_in_both_senses() {
        let te = |theta: f64| 7.3 + 1e-3 * (theta + 0.3).sin() + 2e-4 * (2.0 * theta).cos();
        for direction in Direction::BOTH {
            // 1 000 samples a turn: one or two a bin, unevenly placed.
            for per_turn in [1_000, 7_201, 120_000] {
                let run = run(direction, 1.234, 3.0, per_turn, te);
                assert_eq!(run.revolutions(), 3);
                let curve = run.mean_curve();
                for (value, centre) in curve.values_rad.iter().zip(run.grid().centres()) {
                    // The edge bins of a run hold half of their samples; one second-order term is left.
                    assert!(
                        (value - te(centre)).abs() < 4e-8,
                        "{direction} {per_turn} {centre}: {}",
                        value - te(centre)
                    );
                }
            }
        }
    }

    #[test]
    fn each_bin_of_a_revolution_is_opened_once_by_its_first_sample() {
        for direction in Direction::BOTH {
            let run = run(direction, 0.7, 2.0, 10_000, |_| 0.0);
            let points = run.te_points();
            assert_eq!(points[0].theta1_rad, 0.7);
            let mut seen = std::collections::HashSet::new();
            for point in points {
                assert!(seen.insert((point.revolution, point.bin)));
                assert_eq!(run.grid().bin_of(point.theta1_rad), point.bin);
            }
            assert!((1440..=1441).contains(&points.len()), "{}", points.len());
        }
    }

    #[test]
    fn a_wobble_over_an_edge_opens_nothing_twice() {
        let pair = pair();
        for direction in Direction::BOTH {
            let mut run = RunTe::new(AngleGrid::default(), conditions(direction));
            let edge = 100.0 * run.grid().width_rad();
            let mut opened = 0;
            for n in 0..50 {
                let wobble = if n % 2 == 0 { -1e-4 } else { 1e-4 };
                let theta1 = edge + direction.sign() * wobble;
                opened += usize::from(run.push(&pair, theta1, pair.theta2(theta1)).is_some());
            }
            assert_eq!(opened, 2);
            assert_eq!(run.samples(), 50);
            assert_eq!(run.revolutions(), 0);
        }
    }

    #[test]
    fn broken_samples_are_counted_and_change_nothing() {
        let pair = pair();
        let mut run = RunTe::new(AngleGrid::default(), conditions(Direction::Ccw));
        assert_eq!(run.push(&pair, f64::NAN, 0.0), None);
        assert_eq!(run.push(&pair, 0.0, f64::INFINITY), None);
        assert!(run.push(&pair, 0.1, pair.theta2(0.1)).is_some());
        run.push(&pair, 1e300, 0.0);
        run.push(&pair, -1e300, 0.0);
        run.push(&pair, 9e8, pair.theta2(9e8));
        assert_eq!((run.samples(), run.rejected()), (2, 4));
        assert!(run.mean_curve().coverage() > 0.0);
        assert_eq!(run.revolution_curve(usize::MAX).coverage(), 0.0);
    }
}
