//! Amplitudes as found, and amplitude and phase from two of them.

use super::Parameter;
use nalgebra::DMatrix;

/// Amplitudes of a block with their covariance.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Amplitudes β in the effect's units.
    pub beta: Vec<f64>,
    /// Covariance of β.
    pub covariance: DMatrix<f64>,
}

impl Estimate {
    /// Standard deviation of an amplitude.
    #[must_use]
    pub fn std(&self, n: usize) -> f64 {
        self.covariance[(n, n)].max(0.0).sqrt()
    }

    /// Amplitude and phase of the trace a sin(x − φ) whose columns are sin x and cos x, from the pair of columns at `first`:
    /// β_sin = a cos φ, β_cos = −a sin φ.
    #[must_use]
    pub fn polar(&self, first: usize) -> Polar {
        let (sine, cosine) = (self.beta[first], self.beta[first + 1]);
        let amplitude = sine.hypot(cosine);
        let variance = |a: f64, b: f64| {
            let c = &self.covariance;
            let value =
                a * a * c[(first, first)] + 2.0 * a * b * c[(first, first + 1)] + b * b * c[(first + 1, first + 1)];
            value.max(0.0).sqrt()
        };
        let scale = amplitude.max(f64::MIN_POSITIVE);
        Polar {
            amplitude,
            amplitude_std: variance(sine / scale, cosine / scale),
            phase_rad: (-cosine).atan2(sine),
            phase_std_rad: variance(-cosine / (scale * scale), sine / (scale * scale)).min(std::f64::consts::PI),
        }
    }
}

/// An amplitude and a phase with their standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct Polar {
    /// Amplitude, in the columns' unit.
    pub amplitude: f64,
    /// Its standard deviation.
    pub amplitude_std: f64,
    /// Phase φ of a sin(x − φ), rad.
    pub phase_rad: f64,
    /// Its standard deviation, rad.
    pub phase_std_rad: f64,
}

impl Polar {
    /// As two parameters, the second `phase_rad`.
    #[must_use]
    pub fn parameters(&self, amplitude: &'static str, unit: &'static str) -> Vec<Parameter> {
        vec![
            Parameter::number(amplitude, self.amplitude, self.amplitude_std, unit),
            Parameter::phase("phase_rad", self.phase_rad, self.phase_std_rad),
        ]
    }
}
