//! Are the probabilities true: of all that was said with 70 %, does 70 % come true?

use serde::Serialize;

/// Probabilities up to here are "no", and so many that they would hide the rest.
pub const OVER: f64 = 0.02;
/// Bins of the curve.
const BINS: usize = 10;

/// One bin of the curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bin {
    /// Probabilities in it.
    pub count: usize,
    /// Their mean.
    pub said: f64,
    /// Share that came true.
    pub true_share: f64,
}

/// The calibration of many probabilities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// Bins that hold any, from small to large.
    pub bins: Vec<Bin>,
    /// Expected calibration error of probabilities over 0.02: Σ (n/N) |said − true|.
    pub ece: Option<f64>,
    /// Brier score of the same: the mean of (p − what came true)².
    pub brier: Option<f64>,
    /// Probabilities over 0.02.
    pub count: usize,
    /// Share of the others that came true after all.
    pub missed_share: Option<f64>,
}

impl Calibration {
    /// Of probabilities with what came true.
    #[must_use]
    pub fn of(events: &[(f64, bool)]) -> Self {
        let (over, under): (Vec<_>, Vec<_>) = events.iter().copied().partition(|(p, _)| *p > OVER);
        let mut sums = [(0usize, 0.0, 0usize); BINS];
        for &(p, came_true) in &over {
            let bin = &mut sums[((p * BINS as f64) as usize).min(BINS - 1)];
            *bin = (bin.0 + 1, bin.1 + p, bin.2 + usize::from(came_true));
        }
        let bins: Vec<Bin> = sums
            .into_iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, said, hits)| Bin { count, said: said / count as f64, true_share: hits as f64 / count as f64 })
            .collect();
        let mean = |total: f64| (!over.is_empty()).then(|| total / over.len() as f64);
        let missed = under.iter().filter(|(_, came_true)| *came_true).count();
        Self {
            ece: mean(bins.iter().map(|bin| bin.count as f64 * (bin.said - bin.true_share).abs()).sum()),
            brier: mean(over.iter().map(|(p, came_true)| (p - f64::from(u8::from(*came_true))).powi(2)).sum()),
            count: over.len(),
            missed_share: (!under.is_empty()).then(|| missed as f64 / under.len() as f64),
            bins,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_probabilities_have_no_error_and_boasts_have() {
        let honest: Vec<(f64, bool)> = (0..1000).map(|n| (0.7, n % 10 < 7)).collect();
        let calibration = Calibration::of(&honest);
        assert!(calibration.ece.unwrap() < 1e-9);
        assert!((calibration.brier.unwrap() - 0.21).abs() < 1e-9);
        let boast: Vec<(f64, bool)> = (0..1000).map(|n| (0.99, n % 2 == 0)).collect();
        assert!((Calibration::of(&boast).ece.unwrap() - 0.49).abs() < 1e-9);
    }

    #[test]
    fn small_probabilities_stand_apart() {
        let calibration = Calibration::of(&[(0.001, false), (0.01, true), (0.9, true)]);
        assert_eq!((calibration.count, calibration.missed_share), (1, Some(0.5)));
        let nothing = Calibration::of(&[]);
        assert_eq!((nothing.ece, nothing.brier, nothing.missed_share), (None, None, None));
    }
}
