//! How large an effect is: RMS of what it alone adds to the measured transmission error over a campaign, on a rig without noise.

use std::f64::consts::TAU;

use super::BlindError;
use super::campaign::{self, Campaign, CampaignPlan};
use crate::sim::plant::{Plant, PlantSpec};

/// Sampling of the campaigns that only measure a size, Hz.
const PROBE_RATE_HZ: f64 = 250.0;
/// Bins of the driver's turn in which the rig without the effect is tabulated.
const BINS: usize = 720;

/// The rig without any effect and without noise: TE over the driver's angle, a curve a run.
pub struct Baseline {
    plan: CampaignPlan,
    seed: u64,
    nominal: Plant,
    curves: Vec<Vec<f64>>,
}

impl Baseline {
    /// Measures `spec` without noise.
    ///
    /// # Errors
    /// [`BlindError`] as from [`campaign::run`].
    pub fn measure(spec: &PlantSpec, plan: &CampaignPlan, seed: u64) -> Result<Self, BlindError> {
        let spec = spec.clone().quiet();
        let plan = CampaignPlan { rate_hz: PROBE_RATE_HZ, ..plan.clone() };
        let campaign = campaign::run(&spec, &plan, seed)?;
        let nominal = Plant::new(&spec, PROBE_RATE_HZ, seed)?;
        let curves = (0..campaign.runs.len()).map(|n| curve(&campaign, &nominal, n)).collect();
        Ok(Self { plan, seed, nominal, curves })
    }

    /// RMS of what `spec` adds, rad, its one free zero removed, every run weighing alike; and the times that counts were lost.
    ///
    /// # Errors
    /// [`BlindError`] as from [`campaign::run`].
    pub fn rms_rad(&self, spec: &PlantSpec) -> Result<(f64, u64), BlindError> {
        let campaign = campaign::run(&spec.clone().quiet(), &self.plan, self.seed)?;
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
        Ok(((square - mean * mean).max(0.0).sqrt(), campaign.count_losses))
    }
}

/// TE of a run in bins of the driver's turn.
fn curve(campaign: &Campaign, nominal: &Plant, run: usize) -> Vec<f64> {
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
    use crate::sim::plant::undocumented::find;

    #[test]
    fn sizes_are_those_of_the_formulas() {
        let mut plan = CampaignPlan::usual(1000.0);
        plan.revolutions = 1.0;
        plan.runs.truncate(4);
        let spec = PlantSpec::default();
        let baseline = Baseline::measure(&spec, &plan, 5).unwrap();
        let none = baseline.rms_rad(&spec).unwrap().0;
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
        let got = baseline.rms_rad(&encoder).unwrap().0;
        assert!((got / expected - 1.0).abs() < 0.03, "{got} {expected}");
    }
}
