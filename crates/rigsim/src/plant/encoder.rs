//! Incremental encoders: disc errors, reading noise, counts and the index pulse.

use super::error::{PlantError, in_range};
use super::resonance::SoftCouplingSpec;
use super::table::floor;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// One encoder and its counter.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderSpec {
    /// Lines of the disc.
    pub lines: u32,
    /// Counts per line after interpolation.
    pub counts_per_line: u32,
    /// Eccentricity of the disc in parts of the track's radius.
    pub eccentricity: f64,
    /// Phase of the eccentricity, rad: to first order the reading gains ε sin(θ − phase).
    pub eccentricity_phase_rad: f64,
    /// Ellipticity of the disc: (b − a)/(b + a) of its half axes.
    pub ellipticity: f64,
    /// Phase of the ellipticity, rad: to first order the reading gains ε sin(2θ − phase).
    pub ellipticity_phase_rad: f64,
    /// Sub-divisional error: offset of the two signals in parts of their amplitude.
    pub interpolation: f64,
    /// Its phase, rad: to first order the reading gains (offset/lines) sin(lines · θ − phase).
    pub interpolation_phase_rad: f64,
    /// Angle by which the shaft stands ahead of the scale, rad: how the disc is clocked against the gear.
    pub clocking_rad: f64,
    /// White reading noise, rad RMS.
    pub noise_rad: f64,
}

impl EncoderSpec {
    /// An encoder of the rig unless said otherwise: 18000 lines interpolated 400-fold, a perfect disc.
    fn with_noise(noise_rad: f64) -> Self {
        Self {
            lines: 18_000,
            counts_per_line: 400,
            eccentricity: 0.0,
            eccentricity_phase_rad: 0.0,
            ellipticity: 0.0,
            ellipticity_phase_rad: 0.0,
            interpolation: 0.0,
            interpolation_phase_rad: 0.0,
            clocking_rad: 0.0,
            noise_rad,
        }
    }

    /// Counts per revolution.
    #[must_use]
    pub fn counts_per_rev(&self) -> u64 {
        u64::from(self.lines) * u64::from(self.counts_per_line)
    }

    fn validate(&self) -> Result<(), PlantError> {
        in_range("encoders.lines", f64::from(self.lines), "lines", (1.0, 1e6), "lines of the disc")?;
        in_range(
            "encoders.counts_per_line",
            f64::from(self.counts_per_line),
            "counts",
            (1.0, 1e5),
            "after interpolation",
        )?;
        let size = (-0.1, 0.1);
        in_range("encoders.eccentricity", self.eccentricity, "", size, "in parts of the track's radius")?;
        in_range("encoders.ellipticity", self.ellipticity, "", size, "(b − a)/(b + a) of the half axes")?;
        let phase = (-1e6, 1e6);
        in_range("encoders.eccentricity_phase_rad", self.eccentricity_phase_rad, "rad", phase, "give a finite angle")?;
        in_range("encoders.ellipticity_phase_rad", self.ellipticity_phase_rad, "rad", phase, "give a finite angle")?;
        let offset = (0.0, 0.9);
        in_range("encoders.interpolation", self.interpolation, "", offset, "offset in parts of the signal")?;
        in_range(
            "encoders.interpolation_phase_rad",
            self.interpolation_phase_rad,
            "rad",
            phase,
            "give a finite angle",
        )?;
        in_range("encoders.clocking_rad", self.clocking_rad, "rad", (-7.0, 7.0), "a mounting, a turn at most")?;
        in_range("encoders.noise_rad", self.noise_rad, "rad", (0.0, 0.01), "RMS of one reading")
    }
}

/// Counts that the output's counter loses.
#[derive(Debug, Clone, PartialEq)]
pub struct CountLossSpec {
    /// Counts lost each time; always the same sign, whatever the sense of rotation.
    pub counts: i64,
    /// Mean number of losses per driver revolution; they come at random. 0 switches them off.
    pub losses_per_rev: f64,
}

/// Both encoders and the box that counts and latches them.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodersSpec {
    /// On the input shaft.
    pub input: EncoderSpec,
    /// On the output shaft, past the compliance of gear 2's shaft.
    pub output: EncoderSpec,
    /// The output is latched this much later than the input, s.
    pub time_skew_s: f64,
    /// Lost counts of the output.
    pub output_count_loss: CountLossSpec,
    /// Soft coupling of the output encoder.
    pub output_coupling: Option<SoftCouplingSpec>,
}

impl Default for EncodersSpec {
    fn default() -> Self {
        Self {
            input: EncoderSpec::with_noise(3e-6),
            output: EncoderSpec::with_noise(4e-6),
            time_skew_s: 0.0,
            output_count_loss: CountLossSpec { counts: 0, losses_per_rev: 0.0 },
            output_coupling: None,
        }
    }
}

impl EncodersSpec {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        self.input.validate()?;
        self.output.validate()?;
        in_range("encoders.time_skew_s", self.time_skew_s, "s", (-0.01, 0.01), "keep it within ±10 ms")?;
        self.output_coupling.as_ref().map_or(Ok(()), SoftCouplingSpec::validate)?;
        let loss = &self.output_count_loss;
        in_range(
            "encoders.output_count_loss.counts",
            loss.counts as f64,
            "counts",
            (-1e6, 1e6),
            "counts lost each time",
        )?;
        in_range("encoders.output_count_loss.losses_per_rev", loss.losses_per_rev, "1/rev", (0.0, 1e3), "a mean rate")
    }
}

/// θ + ψ with tan ψ = ε sin w/(1 − ε cos w): the exact reading of a disc that is displaced (w once a turn) or squeezed
/// (w twice).
#[inline]
pub(super) fn distorted(theta: f64, epsilon: f64, w: f64) -> f64 {
    let (sin, cos) = w.sin_cos();
    theta + (epsilon * sin).atan2(1.0 - epsilon * cos)
}

/// A running encoder with its counter.
#[derive(Debug, Clone)]
pub(super) struct Encoder {
    counts_per_rev: f64,
    counts_per_rad: f64,
    revs_per_count: f64,
    noise_counts: f64,
    eccentricity: (f64, f64),
    ellipticity: (f64, f64),
    /// Offset of the signals, phase, lines.
    interpolation: (f64, f64, f64),
    clocking_rad: f64,
    exact_disc: bool,
    /// Count of the scale at which the counter was switched on, plus what it has lost since.
    offset: i64,
    turn: i64,
    index_counts: Option<i64>,
    rng: Pcg64Mcg,
}

impl Encoder {
    /// An encoder whose counter starts at 0 while the shaft stands at `shaft_rad`.
    pub fn new(spec: &EncoderSpec, shaft_rad: f64, rng: Pcg64Mcg) -> Self {
        let counts_per_rev = spec.counts_per_rev() as f64;
        let mut encoder = Self {
            counts_per_rev,
            counts_per_rad: counts_per_rev / TAU,
            revs_per_count: 1.0 / counts_per_rev,
            noise_counts: spec.noise_rad * counts_per_rev / TAU,
            eccentricity: (spec.eccentricity, spec.eccentricity_phase_rad),
            ellipticity: (spec.ellipticity, spec.ellipticity_phase_rad),
            interpolation: (spec.interpolation, spec.interpolation_phase_rad, f64::from(spec.lines)),
            clocking_rad: spec.clocking_rad,
            exact_disc: spec.eccentricity == 0.0 && spec.ellipticity == 0.0 && spec.interpolation == 0.0,
            offset: 0,
            turn: 0,
            index_counts: None,
            rng,
        };
        let scale = encoder.scale_rad(shaft_rad) * encoder.counts_per_rad;
        encoder.offset = floor(scale + 0.5) as i64;
        encoder.turn = floor(scale * encoder.revs_per_count) as i64;
        encoder
    }

    /// Angle on the disc's scale under the reading head, rad.
    ///
    /// Displaced disc: with its centre at ε (in track radii) in the direction w = θ − phase from the head's, the head
    /// sees the scale at θ + atan2(ε sin w, 1 − ε cos w). Squeezed disc: tan turns by (1 + ε)/(1 − ε), the same form in
    /// twice the angle.
    ///
    /// Interpolation: the signals (cos φ, sin φ) of the line phase φ = lines · θ are off their centre by o, so their angle is that of a
    /// displaced disc, φ + atan2(o sin(φ − phase), 1 − o cos(φ − phase)); its second order is o²/2.
    #[inline]
    fn scale_rad(&self, shaft_rad: f64) -> f64 {
        let shaft_rad = shaft_rad - self.clocking_rad;
        if self.exact_disc {
            return shaft_rad;
        }
        let (eccentricity, phase) = self.eccentricity;
        let (ellipticity, phase2) = self.ellipticity;
        let seen = distorted(shaft_rad, eccentricity, shaft_rad - phase);
        let squeezed = distorted(shaft_rad, ellipticity, 2.0 * shaft_rad - phase2);
        let scale_rad = seen + squeezed - shaft_rad;
        let (offset, phase3, lines) = self.interpolation;
        if offset == 0.0 {
            return scale_rad;
        }
        distorted(lines * scale_rad, offset, lines * scale_rad - phase3) / lines
    }

    /// Counter value with the shaft at `shaft_rad`; latches the index on the way.
    ///
    /// The index pulse stands on the middle of count 0 of the scale, so counts less the latched value round to the
    /// angle without bias.
    #[inline]
    pub fn read(&mut self, shaft_rad: f64) -> i64 {
        let scale = self.scale_rad(shaft_rad) * self.counts_per_rad;
        let turn = floor(scale * self.revs_per_count) as i64;
        if turn != self.turn {
            let passed = turn.max(self.turn);
            self.index_counts = Some(passed * self.counts_per_rev as i64 - self.offset);
            self.turn = turn;
        }
        let noise: f64 = StandardNormal.sample(&mut self.rng);
        floor(scale + noise * self.noise_counts + 0.5) as i64 - self.offset
    }

    /// The counter misses `counts`.
    pub fn lose(&mut self, counts: i64) {
        self.offset += counts;
    }

    pub fn index_counts(&self) -> Option<i64> {
        self.index_counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn encoder(change: impl Fn(&mut EncoderSpec), start: f64) -> Encoder {
        let mut spec = EncoderSpec::with_noise(0.0);
        change(&mut spec);
        Encoder::new(&spec, start, Pcg64Mcg::seed_from_u64(3))
    }

    #[test]
    fn counts_start_at_zero_and_the_index_restores_the_angle() {
        let mut encoder = encoder(|_| {}, 2.0);
        assert_eq!(encoder.read(2.0), 0);
        assert_eq!(encoder.index_counts(), None);
        for n in 0..1000 {
            encoder.read(2.0 + f64::from(n) * 0.005);
        }
        let index = encoder.index_counts().unwrap();
        for theta in [7.1, 6.3, 9.9] {
            let angle = TAU * (encoder.read(theta) - index) as f64 / 7.2e6;
            assert!((angle - (theta - TAU)).abs() <= 0.5 * TAU / 7.2e6 + 1e-12);
        }
    }

    #[test]
    fn the_index_is_found_alike_in_both_senses() {
        let mut forward = encoder(|_| {}, -0.5);
        let mut backward = encoder(|_| {}, 0.5);
        for n in 0..=100 {
            forward.read(-0.5 + f64::from(n) * 0.01);
            backward.read(0.5 - f64::from(n) * 0.01);
        }
        let quarter = (0.5 / TAU * 7.2e6f64).round() as i64;
        assert_eq!(forward.index_counts(), Some(quarter));
        assert_eq!(backward.index_counts(), Some(-quarter));
    }

    #[test]
    fn an_eccentric_disc_reads_what_its_geometry_says() {
        let (epsilon, phase) = (0.02, 0.7);
        let encoder = encoder(|spec| (spec.eccentricity, spec.eccentricity_phase_rad) = (epsilon, phase), 0.0);
        for n in 0..50 {
            let theta = f64::from(n) * 0.21;
            // Independent construction: where does the ray from the displaced centre to the head at (1, 0) cut the
            // scale?
            let w = theta - phase;
            let (x, y) = (1.0 - epsilon * w.cos(), -epsilon * w.sin());
            assert!((encoder.scale_rad(theta) - (theta - y.atan2(x))).abs() < 1e-14);
            assert!((encoder.scale_rad(theta) - theta - epsilon * w.sin()).abs() < epsilon * epsilon);
        }
    }

    #[test]
    fn a_squeezed_disc_maps_the_tangent() {
        let epsilon: f64 = 0.03;
        let encoder = encoder(|spec| spec.ellipticity = epsilon, 0.0);
        for n in 0..20 {
            let theta = -1.5 + f64::from(n) * 0.15;
            let expected = (theta.tan() * (1.0 + epsilon) / (1.0 - epsilon)).atan();
            assert!((encoder.scale_rad(theta) - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn displaced_signals_divide_the_lines_unevenly() {
        let (offset, phase) = (0.2, 0.7);
        let encoder = encoder(|spec| (spec.interpolation, spec.interpolation_phase_rad) = (offset, phase), 0.0);
        for n in 0..50 {
            let theta = 1.3 + f64::from(n) * 1.7e-5;
            // Independent construction: the angle of (cos φ, sin φ) less the offset, which points to the phase.
            let line: f64 = 18_000.0 * theta;
            let (x, y) = (line.cos() - offset * phase.cos(), line.sin() - offset * phase.sin());
            let miss = y.atan2(x) - 18_000.0 * encoder.scale_rad(theta);
            assert!((miss - TAU * (miss / TAU).round()).abs() < 1e-9);
            let first = offset / 18_000.0 * (line - phase).sin();
            assert!((encoder.scale_rad(theta) - theta - first).abs() < 0.6 * offset * offset / 18_000.0);
        }
    }

    #[test]
    fn a_clocked_shaft_stands_ahead_of_its_scale() {
        let encoder = encoder(|spec| spec.clocking_rad = 1e-3, 0.0);
        assert!((encoder.scale_rad(2.0) - 1.999).abs() < 1e-15);
    }

    #[test]
    fn noise_has_the_size_asked_for() {
        let mut noisy = encoder(|spec| spec.noise_rad = 4e-6, 0.0);
        let values: Vec<f64> = (0..50_000).map(|_| noisy.read(1.0) as f64 * TAU / 7.2e6 - 1.0).collect();
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / 5e4).sqrt();
        let with_rounding = (4e-6f64.powi(2) + (TAU / 7.2e6).powi(2) / 12.0).sqrt();
        assert!((rms / with_rounding - 1.0).abs() < 0.02, "{rms}");
    }

    #[test]
    fn lost_counts_stay_lost() {
        let mut encoder = encoder(|_| {}, 0.0);
        let before = encoder.read(1.0);
        encoder.lose(7);
        assert_eq!(encoder.read(1.0), before - 7);
    }
}
