//! The residual folded by the encoders' line phase, on the samples: averaging over angle would hide it.
//!
//! Each block of samples spans several line periods; its residual is freed of a straight line, and products with
//! sin and cos of h·L·θ (h = 1, 2; both encoders) are summed. A least-squares fit on those sums gives the sub-divisional
//! errors; the samples' own scatter is their noise.

use nalgebra::{SMatrix, SVector};

use super::settings::LineSettings;

/// Waves: (encoder, order) × (sin, cos).
pub(super) const WAVES: usize = 8;

/// Waves, driver angle and residual of a sample.
type BlockSample = ([f64; WAVES], f64, f64);

/// Sums over blocks.
#[derive(Clone, Debug)]
pub struct LinePhase {
    lines: [Option<f64>; 2],
    settings: LineSettings,
    block: Vec<BlockSample>,
    origin: [f64; 2],
    /// Σ x xᵀ.
    pub(super) gram: SMatrix<f64, WAVES, WAVES>,
    /// Σ x ρ.
    pub(super) products: SVector<f64, WAVES>,
    /// Σ ρ².
    pub(super) squares: f64,
    /// Samples less two a block.
    pub(super) freedom: f64,
}

impl LinePhase {
    pub(super) fn new(lines: [Option<f64>; 2], settings: &LineSettings) -> Self {
        Self {
            lines,
            settings: *settings,
            block: Vec::new(),
            origin: [0.0; 2],
            gram: SMatrix::zeros(),
            products: SVector::zeros(),
            squares: 0.0,
            freedom: 0.0,
        }
    }

    /// Takes a sample: residual with any slow part, and the ratio through which the input encoder is seen. Returns the waves
    /// there.
    pub(super) fn push(&mut self, theta1_rad: f64, theta2_rad: f64, ratio: f64, rho_rad: f64) -> [f64; WAVES] {
        if self.lines == [None, None] {
            return [0.0; WAVES];
        }
        if self.block.is_empty() {
            self.origin = [theta1_rad, theta2_rad];
        }
        let mut x = [0.0; WAVES];
        for (encoder, (angle_rad, gain)) in [(theta1_rad, -ratio), (theta2_rad, 1.0)].into_iter().enumerate() {
            if let Some(lines) = self.lines[encoder] {
                let (sin, cos) = (lines * angle_rad).sin_cos();
                let first = 4 * encoder;
                x[first] = gain * sin;
                x[first + 1] = gain * cos;
                x[first + 2] = gain * 2.0 * sin * cos;
                x[first + 3] = gain * (cos * cos - sin * sin);
            }
        }
        self.block.push((x, theta1_rad, rho_rad));
        let moved = [theta1_rad - self.origin[0], theta2_rad - self.origin[1]];
        let periods = |encoder: usize| {
            self.lines[encoder].map_or(f64::INFINITY, |lines| moved[encoder].abs() * lines / std::f64::consts::TAU)
        };
        if self.block.len() >= self.settings.block_samples && periods(0).min(periods(1)) >= self.settings.block_lines {
            self.flush();
        }
        x
    }

    /// Books the block.
    pub(super) fn flush(&mut self) {
        let n = self.block.len() as f64;
        if self.block.len() >= self.settings.block_samples {
            let mean = |value: &dyn Fn(&BlockSample) -> f64| self.block.iter().map(value).sum::<f64>() / n;
            let (theta, rho) = (mean(&|s| s.1), mean(&|s| s.2));
            let spread: f64 = self.block.iter().map(|s| (s.1 - theta).powi(2)).sum();
            let slope = |value: &dyn Fn(&BlockSample) -> f64| {
                if spread > 0.0 {
                    self.block.iter().map(|s| (s.1 - theta) * value(s)).sum::<f64>() / spread
                } else {
                    0.0
                }
            };
            let rho_slope = slope(&|s| s.2);
            let means: [f64; WAVES] = std::array::from_fn(|k| mean(&|s| s.0[k]));
            let slopes: [f64; WAVES] = std::array::from_fn(|k| slope(&|s| s.0[k]));
            for sample in &self.block {
                let along = sample.1 - theta;
                let r = sample.2 - rho - rho_slope * along;
                let x = SVector::<f64, WAVES>::from_fn(|k, _| sample.0[k] - means[k] - slopes[k] * along);
                self.gram += x * x.transpose();
                self.products += x * r;
                self.squares += r * r;
            }
            self.freedom += n - 2.0;
        }
        self.block.clear();
    }

    /// Takes an error that was found off the sums.
    pub(super) fn take_off(&mut self, error: &LineError) {
        let first = 4 * error.encoder + 2 * (error.order - 1);
        for (n, amplitude) in error.amplitudes.iter().enumerate() {
            let column = self.gram.column(first + n).into_owned();
            self.products -= column * *amplitude;
        }
        self.squares -= error.explained_rad2;
    }

    /// Adds another run's sums.
    pub fn merge(&mut self, other: &Self) {
        self.gram += other.gram;
        self.products += other.products;
        self.squares += other.squares;
        self.freedom += other.freedom;
    }

    /// The wave pair of an encoder (0, 1) and order (1, 2): amplitudes of sin and cos, rad, their covariance, and the log Bayes
    /// factor against none (g-prior of as many samples as there are).
    #[must_use]
    pub fn pair(&self, encoder: usize, order: usize) -> Option<LineError> {
        self.lines[encoder]?;
        let first = 4 * encoder + 2 * (order - 1);
        let gram = self.gram.fixed_view::<2, 2>(first, first).into_owned();
        let products = self.products.fixed_rows::<2>(first).into_owned();
        let inverse = gram.try_inverse()?;
        let beta = inverse * products;
        let explained = products.dot(&beta);
        if self.freedom < self.settings.fewest_freedom || !explained.is_finite() {
            return None;
        }
        let variance = ((self.squares - explained) / (self.freedom - 2.0)).max(f64::MIN_POSITIVE);
        let statistic = explained / variance;
        // Unit-information prior on two amplitudes.
        let log_bayes_factor = 0.5 * statistic - (1.0 + self.freedom).ln();
        Some(LineError {
            encoder,
            order,
            amplitudes: [beta[0], beta[1]],
            covariance: inverse * variance,
            log_bayes_factor,
            explained_rad2: explained,
        })
    }
}

impl LineError {
    /// TE of the error for mean line waves.
    #[must_use]
    pub fn te_rad(&self, lines: &[f64; WAVES]) -> f64 {
        let first = 4 * self.encoder + 2 * (self.order - 1);
        lines[first] * self.amplitudes[0] + lines[first + 1] * self.amplitudes[1]
    }
}

/// A sub-divisional error found.
#[derive(Clone, Copy, Debug)]
pub struct LineError {
    /// Encoder, 0 input, 1 output.
    pub encoder: usize,
    /// Order of the line period.
    pub order: usize,
    /// Sum of squares of the samples that it explains, rad².
    pub explained_rad2: f64,
    /// Amplitudes of sin(hLθ) and cos(hLθ) of the reading error, rad.
    pub amplitudes: [f64; 2],
    /// Their covariance.
    pub covariance: SMatrix<f64, 2, 2>,
    /// Log Bayes factor against no error.
    pub log_bayes_factor: f64,
}
