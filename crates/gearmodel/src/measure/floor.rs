//! Repeatability floor of the mean curve, with an interval.
//!
//! Each of R revolutions loses its own mean (an offset that accumulates is no scatter); s_b² is the variance between the
//! revolutions at bin b, and the floor is √(mean over bins of s_b²/R). The floor² of independent revolutions with normal
//! scatter is about χ²_ν/ν of the true one, ν = (R − 1)·(tr Σ)²/tr Σ² (Satterthwaite 1946), Σ the covariance of the bins:
//! bins that move together are not independent witnesses, and counting each makes the interval far too narrow.
//!
//! ν takes the measured covariance S in place of Σ, so R − 1 ≤ ν ≤ (R − 1)². That is on the wide side by intent: an unbiased
//! (tr Σ)²/tr Σ² gives 90 % on white scatter, but only 67 to 86 % where a common wave lies over it (3 to 10 revolutions),
//! because its errors go with those of the floor. With S, simulated intervals of 90 % cover 88 to 100 %: about 90 % where
//! one common wave is the scatter, nearly always where it is white.

use serde::{Deserialize, Serialize};

use super::grid::Curve;
use super::run_te::RunTe;

/// Confidence of [`RepeatabilityFloor::of`].
const DEFAULT_CONFIDENCE: f64 = 0.9;
/// Above this the quantile is Wilson–Hilferty's.
const LARGE_DEGREES_OF_FREEDOM: f64 = 200.0;

/// Why there is no floor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FloorError {
    /// Scatter needs two revolutions.
    #[error("a floor from {revolutions} whole revolutions is not to be had, 2 are the fewest: record a longer run")]
    Revolutions {
        /// Whole revolutions there.
        revolutions: usize,
    },
    /// Curves on different grids.
    #[error("revolution {revolution} has {bins} bins, the first has {first}: analyse all on one grid")]
    GridMismatch {
        /// Index of the odd one.
        revolution: usize,
        /// Its bins.
        bins: usize,
        /// Bins of the first.
        first: usize,
    },
    /// No bins in common.
    #[error(
        "{common} bins were seen in all {revolutions} revolutions, 2 are the fewest: drop the patchy \
         revolutions or take a coarser grid"
    )]
    NoCommonBins {
        /// Bins seen in all revolutions.
        common: usize,
        /// Revolutions.
        revolutions: usize,
    },
    /// A confidence that is none.
    #[error("a confidence of {confidence} is outside 0.5 to 0.999: 0.9 is usual")]
    Confidence {
        /// Confidence asked for.
        confidence: f64,
    },
}

/// Repeatability of a mean curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepeatabilityFloor {
    /// The floor, rad RMS.
    pub floor_rms_rad: f64,
    /// Lower end of the two-sided interval, rad RMS.
    pub lower_rms_rad: f64,
    /// Upper end of the two-sided interval, rad RMS.
    pub upper_rms_rad: f64,
    /// Confidence of the interval, 0 to 1.
    pub confidence: f64,
    /// ν, estimated from the scatter itself: R − 1 of one common wave, up to (R − 1)² of white scatter.
    pub degrees_of_freedom: f64,
    /// Whole revolutions R.
    pub revolutions: usize,
    /// Bins seen in all of them.
    pub bins: usize,
}

impl RepeatabilityFloor {
    /// Floor of a run from its whole revolutions, with a 90 % interval.
    ///
    /// # Errors
    /// [`FloorError`] for fewer than two whole revolutions, or fewer than two bins in common.
    pub fn of(run: &RunTe) -> Result<Self, FloorError> {
        let curves: Vec<Curve> = run.whole_revolutions().map(|(_, curve)| curve).collect();
        Self::of_curves(&curves, DEFAULT_CONFIDENCE)
    }

    /// Floor of the mean of one curve a revolution, over the bins that all of them saw.
    ///
    /// # Errors
    /// [`FloorError`] as for [`RepeatabilityFloor::of`], for curves on different grids and for a confidence outside 0.5 to
    /// 0.999.
    pub fn of_curves(curves: &[Curve], confidence: f64) -> Result<Self, FloorError> {
        if !(0.5..=0.999).contains(&confidence) {
            return Err(FloorError::Confidence { confidence });
        }
        let revolutions = curves.len();
        if revolutions < 2 {
            return Err(FloorError::Revolutions { revolutions });
        }
        let residuals = residuals(curves)?;
        let bins = residuals[0].len();
        // With E the R × B residuals and n = R − 1: tr S = tr(E Eᵀ)/n and tr S² = ‖E Eᵀ‖²/n², from an R × R product alone.
        let n = (revolutions - 1) as f64;
        let (mut trace, mut trace_of_square) = (0.0, 0.0);
        for (i, left) in residuals.iter().enumerate() {
            for (j, right) in residuals.iter().enumerate().take(i + 1) {
                let product: f64 = left.iter().zip(right).map(|(a, b)| a * b).sum();
                trace += if i == j { product / n } else { 0.0 };
                trace_of_square += if i == j { 1.0 } else { 2.0 } * (product / n).powi(2);
            }
        }
        let floor_rms_rad = (trace / (bins as f64 * revolutions as f64)).sqrt();
        // ν = n (tr S)²/tr S²; rank one gives n, and no scatter at all is taken for that.
        let independent = if trace_of_square > 0.0 { (trace * trace / trace_of_square).clamp(1.0, n) } else { 1.0 };
        let degrees_of_freedom = n * independent;
        // ν·floor²/χ²(1 ∓ tail) bounds the true floor².
        let tail = 0.5 * (1.0 - confidence);
        let bound = |probability: f64| {
            floor_rms_rad * (degrees_of_freedom / chi_square_quantile(probability, degrees_of_freedom)).sqrt()
        };
        Ok(Self {
            floor_rms_rad,
            lower_rms_rad: bound(1.0 - tail),
            upper_rms_rad: bound(tail),
            confidence,
            degrees_of_freedom,
            revolutions,
            bins,
        })
    }
}

/// Curves on their common bins, less their own mean, less the mean of all.
fn residuals(curves: &[Curve]) -> Result<Vec<Vec<f64>>, FloorError> {
    let first = curves[0].values_rad.len();
    if let Some((revolution, odd)) = curves.iter().enumerate().find(|(_, curve)| curve.values_rad.len() != first) {
        return Err(FloorError::GridMismatch { revolution, bins: odd.values_rad.len(), first });
    }
    let common: Vec<usize> =
        (0..first).filter(|&bin| curves.iter().all(|curve| curve.values_rad[bin].is_finite())).collect();
    if common.len() < 2 {
        return Err(FloorError::NoCommonBins { common: common.len(), revolutions: curves.len() });
    }
    let mut rows: Vec<Vec<f64>> = curves
        .iter()
        .map(|curve| {
            let mean_rad = common.iter().map(|&bin| curve.values_rad[bin]).sum::<f64>() / common.len() as f64;
            common.iter().map(|&bin| curve.values_rad[bin] - mean_rad).collect()
        })
        .collect();
    for bin in 0..common.len() {
        let mean_rad = rows.iter().map(|row| row[bin]).sum::<f64>() / rows.len() as f64;
        rows.iter_mut().for_each(|row| row[bin] -= mean_rad);
    }
    Ok(rows)
}

/// Quantile of χ² with ν ≥ 1 degrees of freedom, `probability` in 0.0005 to 0.9995.
///
/// Above ν = 200 Wilson and Hilferty (1931), ν (1 − 2/(9ν) + z √(2/(9ν)))³, within 1e-4 of itself; below, where it fails
/// (−23 % at ν = 2, 5 %), the root of the incomplete gamma function, within 1e-9.
fn chi_square_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom > LARGE_DEGREES_OF_FREEDOM {
        let ninth = 2.0 / (9.0 * degrees_of_freedom);
        return degrees_of_freedom * (1.0 - ninth + normal_quantile(probability) * ninth.sqrt()).powi(3);
    }
    let shape = 0.5 * degrees_of_freedom;
    // 12 standard deviations and some: above any quantile asked for.
    let (mut low, mut high) = (0.0, degrees_of_freedom + 12.0 * (2.0 * degrees_of_freedom).sqrt() + 12.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if lower_gamma(shape, 0.5 * middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Regularised P(a, x) = xᵃ e⁻ˣ/Γ(a+1) · Σ xᵏ/((a+1)…(a+k)) (Abramowitz and Stegun 6.5.29).
fn lower_gamma(shape: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (mut term, mut sum, mut k) = (1.0, 1.0, 0.0);
    while term > 1e-17 * sum {
        k += 1.0;
        term *= x / (shape + k);
        sum += term;
    }
    (shape * x.ln() - x - ln_gamma(shape + 1.0)).exp() * sum
}

/// ln Γ(x), x > 0, by Stirling's series after moving x above 12, within 1e-13.
fn ln_gamma(x: f64) -> f64 {
    let (mut shifted, mut product) = (x, 1.0);
    while shifted < 12.0 {
        product *= shifted;
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    let square = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    (shifted - 0.5) * shifted.ln() - shifted + 0.5 * std::f64::consts::TAU.ln() + series - product.ln()
}

/// Standard normal quantile (Abramowitz and Stegun 26.2.23), within 4.5e-4.
fn normal_quantile(probability: f64) -> f64 {
    let tail = probability.min(1.0 - probability);
    let t = (-2.0 * tail.ln()).sqrt();
    let z =
        t - (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    if probability < 0.5 { -z } else { z }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// R revolutions with `common` waves that move all bins together and `separate` scatter of each bin.
    fn revolutions(random: &mut Pcg64, count: usize, bins: usize, common: f64, separate: f64) -> Vec<Curve> {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        (0..count)
            .map(|_| {
                let size = common * normal();
                let values_rad = (0..bins)
                    .map(|bin| {
                        let wave = (std::f64::consts::TAU * bin as f64 / bins as f64).cos();
                        3.0 + size * wave + separate * normal()
                    })
                    .collect();
                Curve { values_rad }
            })
            .collect()
    }

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (probability, nu, expected) in [
            (0.05, 1.0, 0.003_932_14),
            (0.95, 1.0, 3.841_458_82),
            (0.05, 2.0, 0.102_586_589),
            (0.95, 2.0, 5.991_464_55),
            (0.05, 10.0, 3.940_299_14),
            (0.95, 10.0, 18.307_038_1),
            (0.05, 100.0, 77.929_465_2),
            (0.95, 100.0, 124.342_113),
        ] {
            let quantile = chi_square_quantile(probability, nu);
            assert!((quantile / expected - 1.0).abs() < 1e-6, "{probability} {nu}: {quantile}");
        }
        // Both ways of reckoning meet.
        for probability in [0.05, 0.95] {
            let (exact, approximate) =
                (chi_square_quantile(probability, 200.0), chi_square_quantile(probability, 200.0 + 1e-9));
            assert!((exact / approximate - 1.0).abs() < 1e-4, "{exact} {approximate}");
        }
    }

    #[test]
    fn two_revolutions_by_hand() {
        let curve = |values: [f64; 2]| Curve { values_rad: values.to_vec() };
        // Each less its mean: (1, −1) and (3, −3); s² = 2 at both bins; floor = √(2/2).
        let floor = RepeatabilityFloor::of_curves(&[curve([11.0, 9.0]), curve([3.0, -3.0])], 0.9).unwrap();
        assert!((floor.floor_rms_rad - 1.0).abs() < 1e-15);
        assert_eq!(floor.degrees_of_freedom, 1.0);
        assert!((floor.upper_rms_rad - 1.0 / 0.003_932_14_f64.sqrt()).abs() < 1e-4);
        assert!((floor.lower_rms_rad - 1.0 / 3.841_458_82_f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn degrees_of_freedom_tell_common_from_separate_motion() {
        let mut random = Pcg64::new(1, 2);
        let nu = |curves: &[Curve]| RepeatabilityFloor::of_curves(curves, 0.9).unwrap().degrees_of_freedom;
        let together = nu(&revolutions(&mut random, 9, 120, 1.0, 0.0));
        assert!((together - 8.0).abs() < 1e-6, "{together}");
        let apart = nu(&revolutions(&mut random, 9, 120, 0.0, 1.0));
        // tr S² of white scatter: (tr Σ)²·(1/n + (1 + 1/n)/(B − 1)), n = 8, B = 120
        let expected = 8.0 / (1.0 / 8.0 + (9.0 / 8.0) / 119.0);
        assert!((apart / expected - 1.0).abs() < 0.1, "{apart} {expected}");
    }

    #[test]
    fn the_interval_covers_the_truth_at_least_about_nine_times_in_ten() {
        // 2.5 % under 90 % is two standard deviations of 600 trials.
        for (common, separate, most) in [(0.0, 1.0, 1.0), (1.0, 0.1, 0.93), (1.0, 0.5, 1.0), (0.5, 0.5, 1.0)] {
            let (count, bins, trials) = (6, 48, 600);
            // Mean over bins of the variance: cos² averages to ½, the removed mean takes 1/B of the separate part.
            let variance = 0.5 * common * common + separate * separate * (1.0 - 1.0 / bins as f64);
            let truth = (variance / count as f64).sqrt();
            let mut random = Pcg64::new(7, 11);
            let covered = (0..trials)
                .filter(|_| {
                    let curves = revolutions(&mut random, count, bins, common, separate);
                    let floor = RepeatabilityFloor::of_curves(&curves, 0.9).unwrap();
                    (floor.lower_rms_rad..=floor.upper_rms_rad).contains(&truth)
                })
                .count();
            let share = covered as f64 / f64::from(trials);
            assert!((0.875..=most).contains(&share), "{common} {separate}: {share}");
        }
    }

    #[test]
    fn no_scatter_is_a_floor_of_nothing_and_faults_are_named() {
        let curve = Curve { values_rad: vec![1.0, 2.0, f64::NAN, 4.0] };
        let floor = RepeatabilityFloor::of_curves(&[curve.clone(), curve.clone()], 0.9).unwrap();
        assert_eq!((floor.floor_rms_rad, floor.upper_rms_rad, floor.bins), (0.0, 0.0, 3));
        let of = RepeatabilityFloor::of_curves;
        assert!(matches!(of(std::slice::from_ref(&curve), 0.9), Err(FloorError::Revolutions { revolutions: 1 })));
        assert!(matches!(of(&[curve.clone(), curve.clone()], 1.0), Err(FloorError::Confidence { .. })));
        let short = Curve { values_rad: vec![1.0] };
        assert!(matches!(of(&[curve.clone(), short], 0.9), Err(FloorError::GridMismatch { revolution: 1, .. })));
        let blind = Curve { values_rad: vec![f64::NAN; 4] };
        assert!(matches!(of(&[curve, blind], 0.9), Err(FloorError::NoCommonBins { common: 0, .. })));
    }
}
