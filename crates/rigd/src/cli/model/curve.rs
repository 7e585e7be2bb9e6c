//! A quantity over θ1: where it is asked for, its figures, and its text.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use serde::Serialize;

use super::error::{ModelError, check_count};
use crate::chart::Axis;
use crate::present::{angle, arcsec};

/// Where over θ1.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Sampling {
    /// Points a turn of the driver, evenly from θ1 = 0
    #[arg(long, default_value_t = 720, value_name = "N")]
    points: u32,
    /// Turns of the driver; with unequal tooth numbers one turn is not all
    #[arg(long, default_value_t = 1, value_name = "N")]
    turns: u32,
}

impl Sampling {
    /// The angles, rad.
    ///
    /// # Errors
    /// [`ModelError::Count`] for numbers that make no curve.
    pub fn angles_rad(self) -> Result<Vec<f64>, ModelError> {
        let points = check_count("--points", self.points.into(), (4, 1_000_000))?;
        let turns = check_count("--turns", self.turns.into(), (1, 10_000))?;
        let all = check_count("--points times --turns", points * turns, (4, 10_000_000))?;
        Ok((0..all).map(|n| TAU * n as f64 / points as f64).collect())
    }
}

// A picture's axis over these angles.
impl From<Sampling> for Axis {
    fn from(sampling: Sampling) -> Self {
        if sampling.turns > 1 { Self::Fitted("θ1 / °".into()) } else { Self::Turn }
    }
}

/// The figures of a curve, rad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Mean.
    pub mean_rad: f64,
    /// Largest less smallest.
    pub pp_rad: f64,
    /// √(mean of squares).
    pub rms_rad: f64,
    /// Smallest.
    pub min_rad: f64,
    /// θ1 of the smallest.
    pub min_at_rad: f64,
    /// Largest.
    pub max_rad: f64,
    /// θ1 of the largest.
    pub max_at_rad: f64,
}

impl Figures {
    /// The figures of values at angles.
    #[must_use]
    pub fn of(theta1_rad: &[f64], values_rad: &[f64]) -> Self {
        let count = values_rad.len() as f64;
        let seed = (f64::NAN, f64::INFINITY);
        let least = |sign: f64| {
            theta1_rad
                .iter()
                .zip(values_rad)
                .map(|(theta, value)| (*theta, sign * value))
                .fold(seed, |best, one| if one.1 < best.1 { one } else { best })
        };
        let ((min_at_rad, min_rad), (max_at_rad, negated)) = (least(1.0), least(-1.0));
        Self {
            mean_rad: values_rad.iter().sum::<f64>() / count,
            pp_rad: -negated - min_rad,
            rms_rad: (values_rad.iter().map(|value| value * value).sum::<f64>() / count).sqrt(),
            min_rad,
            min_at_rad,
            max_rad: -negated,
            max_at_rad,
        }
    }

    /// The figures as lines for people.
    #[must_use]
    pub fn text(&self) -> String {
        format!(
            "  mean          {}\n  peak-to-peak  {}\n  rms           {}\n  least         {} at θ1 = {:.1}°\n  largest       {} at θ1 = {:.1}°\n",
            angle(self.mean_rad),
            angle(self.pp_rad),
            angle(self.rms_rad),
            angle(self.min_rad),
            self.min_at_rad.to_degrees(),
            angle(self.max_rad),
            self.max_at_rad.to_degrees()
        )
    }
}

/// Rows of a table for people.
const ROWS: usize = 24;

/// Some twenty rows of curves: θ1 in degrees, the values in arcsec.
#[must_use]
pub fn rows(theta1_rad: &[f64], curves: &[(String, &[f64])]) -> String {
    let mut text = format!("{:>8}", "θ1 / °");
    for (name, _) in curves {
        // Writing to a String cannot fail.
        let _ = write!(text, "  {name:>18}");
    }
    text.push('\n');
    let every = theta1_rad.len().div_ceil(ROWS).max(1);
    for index in (0..theta1_rad.len()).step_by(every) {
        let _ = write!(text, "{:>8.2}", theta1_rad[index].to_degrees());
        for (_, values_rad) in curves {
            let _ = write!(text, "  {:>17.2}\"", arcsec(values_rad[index]));
        }
        text.push('\n');
    }
    text
}

/// Points for a picture: degrees and µrad.
#[must_use]
pub fn points(theta1_rad: &[f64], values_rad: &[f64]) -> Vec<(f64, f64)> {
    theta1_rad.iter().zip(values_rad).map(|(theta, value)| (theta.to_degrees(), value * 1e6)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_sine() {
        let theta1: Vec<f64> = (0..360).map(|n| TAU * f64::from(n) / 360.0).collect();
        let values: Vec<f64> = theta1.iter().map(|theta| 2.0 + theta.sin()).collect();
        let figures = Figures::of(&theta1, &values);
        assert!((figures.mean_rad - 2.0).abs() < 1e-12 && (figures.pp_rad - 2.0).abs() < 1e-12);
        assert!((figures.rms_rad - 4.5_f64.sqrt()).abs() < 1e-12);
        assert!((figures.max_at_rad - TAU / 4.0).abs() < 1e-12 && (figures.min_at_rad - 0.75 * TAU).abs() < 1e-12);
    }
}
