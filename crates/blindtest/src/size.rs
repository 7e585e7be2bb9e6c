//! How large an effect is: RMS of what it alone adds to the measured transmission error over a campaign, on a rig without noise.

use std::f64::consts::TAU;

use super::campaign::{self, WithheldCampaign, WithheldPlan};
use super::error::BlindError;
use rigsim::plant::{Plant, PlantSpec};

/// Sampling of the campaigns that only measure a size, Hz.
const PROBE_RATE_HZ: f64 = 250.0;
/// Bins of the driver's turn in which the rig without the effect is tabulated.
const BINS: usize = 720;

/// The rig without any effect and without noise: TE over the driver's angle, a curve a run.
pub struct Baseline {
    plan: WithheldPlan,
    nominal: Plant,
    curves: Vec<Vec<f64>>,
}

impl Baseline {
    /// Measures `spec` without noise.
    ///
    /// # Errors
    /// [`BlindError`] as from [`campaign::run`].
    pub fn measure(spec: &PlantSpec, plan: &WithheldPlan) -> Result<Self, BlindError> {
        let spec = spec.clone().quiet();
        // Every revolution is like the first, and where it begins does not matter.
        let plan = WithheldPlan { rate_hz: PROBE_RATE_HZ, revolutions: 1.0, ..plan.clone() };
        let campaign = campaign::run(&spec, &plan, 1)?;
        let nominal = Plant::new(&spec, PROBE_RATE_HZ, 1)?;
        let curves = (0..campaign.runs.len()).map(|n| curve(&campaign, &nominal, n)).collect();
        Ok(Self { plan, nominal, curves })
    }

    /// RMS of what `spec` adds over `revolutions` a run, rad, its one free zero removed, every run weighing alike. `seed` is that of the
    /// campaign, so that random events come as they will.
    ///
    /// # Errors
    /// [`BlindError`] as from [`campaign::run`].
    pub fn rms_rad(&self, spec: &PlantSpec, revolutions: f64, seed: u64) -> Result<f64, BlindError> {
        let plan = WithheldPlan { revolutions, ..self.plan.clone() };
        let campaign = campaign::run(&spec.clone().quiet(), &plan, seed)?;
        let (mut mean, mut square) = (0.0, 0.0);
        let weight = 1.0 / campaign.runs.len() as f64;
        for (span, curve) in campaign.runs.iter().zip(&self.curves) {
            let share = weight / (span.to - span.from) as f64;
            for sample in span.from..span.to {
                let [theta1, theta2] = campaign.angles_rad(sample);
                let added = theta2 - self.nominal.nominal_driven_rad(theta1) - at(curve, theta1);
                mean += share * added;
                square += share * added * added;
            }
        }
        Ok((square - mean * mean).max(0.0).sqrt())
    }
}

/// TE of a run in bins of the driver's turn.
fn curve(campaign: &WithheldCampaign, nominal: &Plant, run: usize) -> Vec<f64> {
    let span = campaign.runs[run];
    let mut sums = vec![(0.0, 0.0); BINS];
    for sample in span.from..span.to {
        let [theta1, theta2] = campaign.angles_rad(sample);
        let place = theta1.rem_euclid(TAU) / TAU * BINS as f64;
        let bin = place as usize % BINS;
        let te = theta2 - nominal.nominal_driven_rad(theta1);
        // Both neighbours by nearness: a straight line through the bins' edges.
        let near = place - place.floor();
        for (index, share) in [(bin, 1.0 - near), ((bin + 1) % BINS, near)] {
            sums[index].0 += share * te;
            sums[index].1 += share;
        }
    }
    sums.iter().map(|(te, weight)| if *weight > 0.0 { te / weight } else { 0.0 }).collect()
}

/// A tabulated curve at an angle, on the straight line between its bins.
fn at(curve: &[f64], theta1_rad: f64) -> f64 {
    let place = theta1_rad.rem_euclid(TAU) / TAU * BINS as f64;
    let (bin, near) = (place as usize % BINS, place - place.floor());
    curve[bin] + near * (curve[(bin + 1) % BINS] - curve[bin])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigsim::plant::faults::find;

    #[test]
    fn sizes_are_those_of_the_formulas() {
        let mut plan = WithheldPlan::usual(1000.0);
        plan.runs.truncate(4);
        let spec = PlantSpec::default();
        let baseline = Baseline::measure(&spec, &plan).unwrap();
        let none = baseline.rms_rad(&spec, 1.0, 5).unwrap();
        assert!(none < 1.5e-6, "{none}");
        let mut encoder = spec.clone();
        let effect = find("encoder2_ellipticity").unwrap();
        effect.apply_usual(&mut encoder);
        // ε sin(2 f(θ1) − phase) over θ1: on an ellipse not quite ε/√2, for its mean over θ1 is not zero.
        let nominal = Plant::new(&spec, 1000.0, 1).unwrap();
        let values: Vec<f64> = (0..3600)
            .map(|n| 3e-5 * (2.0 * nominal.nominal_driven_rad(f64::from(n) * TAU / 3600.0) - 2.1).sin())
            .collect();
        let mean = values.iter().sum::<f64>() / 3600.0;
        let expected = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3600.0).sqrt();
        let got = baseline.rms_rad(&encoder, 1.0, 5).unwrap();
        assert!((got / expected - 1.0).abs() < 0.03, "{got} {expected}");
    }
}
