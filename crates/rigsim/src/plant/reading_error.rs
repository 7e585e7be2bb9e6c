//! What can go wrong with the reading of the driven angle and belongs to no effect that the diagnosis knows.
//!
//! A reading error is a displacement of the output encoder's reading against its shaft. Waves over a shaft's angle or over time, weighed by
//! the state of the rig; a mount that drifts; knocks that ring out; bursts of nonsense; a seat that settles after a reversal.

use super::error::{PlantError, in_range};
use rand_distr::{Distribution, Exp1, StandardNormal, StandardUniform};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Load at which a wave that grows with the load has its amplitude, N·m.
const REFERENCE_LOAD_NM: f64 = 10.0;
/// Speed of the driver at which a wave that grows with the speed has its amplitude, rad/s: 5 rpm.
const REFERENCE_SPEED_RAD_PER_S: f64 = 5.0 * TAU / 60.0;

/// Over what a wave runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// Turns of the driver.
    Input,
    /// Turns of the driven shaft.
    Output,
    /// Seconds.
    Time,
}

/// What a wave's size depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    /// Nothing.
    Constant,
    /// √(T/10 N·m).
    RootLoad,
    /// (speed/5 rpm)².
    SpeedSquared,
    /// 1 while the driver turns ccw (+1) or cw (−1), 0 in the other sense.
    Sense(f64),
    /// Time over the given seconds.
    Age(f64),
}

/// One reading error.
#[derive(Debug, Clone, PartialEq)]
pub enum ReadingError {
    /// amplitude · weight · sin(2π · order · abscissa − phase); a square wave of the same size where `square`.
    Wave {
        /// Over what it runs.
        abscissa: Abscissa,
        /// Waves per turn, or per second.
        order: f64,
        /// Amplitude, rad.
        amplitude_rad: f64,
        /// Phase, rad.
        phase_rad: f64,
        /// What it depends on.
        weight: Weight,
        /// Square instead of round.
        square: bool,
    },
    /// The mount turns steadily.
    Drift {
        /// rad a second.
        rad_per_s: f64,
    },
    /// Knocks at random, ringing out.
    Knocks {
        /// Mean number a minute.
        per_minute: f64,
        /// Size of the first swing, rad RMS.
        size_rad: f64,
        /// Time constant of the decay, s.
        decay_s: f64,
        /// Ringing, Hz.
        ring_hz: f64,
    },
    /// Bursts in which every reading is wrong.
    Bursts {
        /// Mean number a minute.
        per_minute: f64,
        /// Length, s.
        length_s: f64,
        /// Error of a reading, rad RMS.
        size_rad: f64,
    },
    /// After a reversal into this sense the reading is off, and settles over the angle travelled.
    Settling {
        /// +1 after a reversal to ccw, −1 to cw.
        sense: f64,
        /// At the reversal, rad.
        size_rad: f64,
        /// Travel over which it falls to 1/e, rad of the driver.
        travel_rad: f64,
    },
}

impl ReadingError {
    pub(super) fn validate(&self) -> Result<(), PlantError> {
        let size =
            |value: f64| in_range("reading error's size", value, "rad", (-0.01, 0.01), "a displacement of the reading");
        match *self {
            Self::Wave { order, amplitude_rad, phase_rad, weight, .. } => {
                in_range("reading error's order", order, "1/turn or Hz", (0.0, 1e5), "waves per turn or second")?;
                in_range("reading error's phase", phase_rad, "rad", (-1e6, 1e6), "give a finite angle")?;
                if let Weight::Age(over_s) = weight {
                    in_range("reading error's age", over_s, "s", (1.0, 1e6), "time over which it grows")?;
                }
                size(amplitude_rad)
            }
            Self::Drift { rad_per_s } => {
                in_range("reading error's drift", rad_per_s, "rad/s", (-1e-3, 1e-3), "of the encoder's mount")
            }
            Self::Knocks { per_minute, size_rad, decay_s, ring_hz } => {
                in_range("knocks", per_minute, "1/min", (0.0, 600.0), "a mean rate")?;
                in_range("decay of a knock", decay_s, "s", (1e-3, 60.0), "time constant")?;
                in_range("ringing of a knock", ring_hz, "Hz", (0.0, 1e3), "under the sample rate")?;
                size(size_rad)
            }
            Self::Bursts { per_minute, length_s, size_rad } => {
                in_range("bursts", per_minute, "1/min", (0.0, 600.0), "a mean rate")?;
                in_range("length of a burst", length_s, "s", (1e-3, 60.0), "of wrong readings")?;
                size(size_rad)
            }
            Self::Settling { size_rad, travel_rad, .. } => {
                in_range("travel of settling", travel_rad, "rad", (1e-2, 1e3), "of the driver")?;
                size(size_rad)
            }
        }
    }
}

/// The rig as a reading error sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct RigState {
    pub time_s: f64,
    pub dt_s: f64,
    pub theta1_rad: f64,
    pub theta2_rad: f64,
    pub speed_rad_per_s: f64,
    pub load_nm: f64,
}

/// A reading error at work.
#[derive(Debug, Clone)]
pub(super) struct ActiveReadingError {
    error: ReadingError,
    rng: Pcg64Mcg,
    /// Time of the next event.
    next_s: f64,
    /// Knocks: envelope and phase; bursts: time left; settling: what is left of it.
    level: f64,
    since_s: f64,
    turning: f64,
}

impl ActiveReadingError {
    pub fn new(error: &ReadingError, rng: Pcg64Mcg) -> Self {
        let mut running = Self { error: error.clone(), rng, next_s: 0.0, level: 0.0, since_s: 0.0, turning: 0.0 };
        running.next_s = running.wait_s();
        running
    }

    /// Time to the next event.
    fn wait_s(&mut self) -> f64 {
        let per_minute = match self.error {
            ReadingError::Knocks { per_minute, .. } | ReadingError::Bursts { per_minute, .. } => per_minute,
            _ => 0.0,
        };
        let draw: f64 = Exp1.sample(&mut self.rng);
        if per_minute > 0.0 { 60.0 / per_minute * draw } else { f64::INFINITY }
    }

    fn due(&mut self, time_s: f64) -> bool {
        if time_s < self.next_s {
            return false;
        }
        self.next_s = time_s + self.wait_s();
        true
    }

    /// Displacement of the reading, rad, at the end of a sample period.
    pub fn advance(&mut self, rig: &RigState) -> f64 {
        match self.error {
            ReadingError::Wave { abscissa, order, amplitude_rad, phase_rad, weight, square } => {
                let angle = match abscissa {
                    Abscissa::Input => rig.theta1_rad,
                    Abscissa::Output => rig.theta2_rad,
                    Abscissa::Time => TAU * rig.time_s,
                };
                let weight = match weight {
                    Weight::Constant => 1.0,
                    Weight::RootLoad => (rig.load_nm.abs() / REFERENCE_LOAD_NM).sqrt(),
                    Weight::SpeedSquared => (rig.speed_rad_per_s / REFERENCE_SPEED_RAD_PER_S).powi(2),
                    Weight::Sense(sense) => f64::from(u8::from(rig.speed_rad_per_s * sense > 0.0)),
                    Weight::Age(over_s) => rig.time_s / over_s,
                };
                let wave = (order * angle - phase_rad).sin();
                amplitude_rad * weight * if square { 1f64.copysign(wave) } else { wave }
            }
            ReadingError::Drift { rad_per_s } => rad_per_s * rig.time_s,
            ReadingError::Knocks { size_rad, decay_s, ring_hz, .. } => {
                self.level *= (-rig.dt_s / decay_s).exp();
                if self.due(rig.time_s) {
                    let draw: f64 = StandardNormal.sample(&mut self.rng);
                    self.level = size_rad * draw;
                    self.since_s = rig.time_s;
                }
                self.level * (TAU * ring_hz * (rig.time_s - self.since_s)).cos()
            }
            ReadingError::Bursts { length_s, size_rad, .. } => {
                if self.due(rig.time_s) {
                    let draw: f64 = StandardUniform.sample(&mut self.rng);
                    self.level = length_s * (0.5 + draw);
                }
                if self.level <= 0.0 {
                    return 0.0;
                }
                self.level -= rig.dt_s;
                let draw: f64 = StandardNormal.sample(&mut self.rng);
                size_rad * draw
            }
            ReadingError::Settling { sense, size_rad, travel_rad } => {
                let turning = if rig.speed_rad_per_s == 0.0 { self.turning } else { rig.speed_rad_per_s.signum() };
                if turning != self.turning {
                    self.level = if turning == sense { size_rad } else { 0.0 };
                    self.turning = turning;
                }
                self.level *= (-(rig.speed_rad_per_s * rig.dt_s).abs() / travel_rad).exp();
                self.level
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn rig(time_s: f64) -> RigState {
        RigState { time_s, dt_s: 1e-3, theta1_rad: 0.3, theta2_rad: 0.5, speed_rad_per_s: 1.0, load_nm: 5.0 }
    }

    fn running(error: &ReadingError) -> ActiveReadingError {
        error.validate().unwrap();
        ActiveReadingError::new(error, Pcg64Mcg::seed_from_u64(4))
    }

    fn wave(abscissa: Abscissa, weight: Weight, square: bool) -> ReadingError {
        ReadingError::Wave { abscissa, order: 3.0, amplitude_rad: 1e-5, phase_rad: 0.2, weight, square }
    }

    #[test]
    fn waves_run_over_their_carrier_and_have_their_weight() {
        let at = |error: ReadingError, rig: RigState| running(&error).advance(&rig) / 1e-5;
        let plain = |angle: f64| (3.0 * angle - 0.2).sin();
        assert!((at(wave(Abscissa::Input, Weight::Constant, false), rig(2.0)) - plain(0.3)).abs() < 1e-12);
        assert!((at(wave(Abscissa::Time, Weight::Constant, false), rig(2.1)) - plain(TAU * 2.1)).abs() < 1e-9);
        let root = at(wave(Abscissa::Output, Weight::RootLoad, false), rig(0.0));
        assert!((root - plain(0.5) * 0.5f64.sqrt()).abs() < 1e-12);
        let slow = RigState { speed_rad_per_s: 0.5, ..rig(0.0) };
        let fast = wave(Abscissa::Output, Weight::SpeedSquared, false);
        assert!((at(fast.clone(), rig(0.0)) / at(fast, slow) - 4.0).abs() < 1e-12);
        assert_eq!(at(wave(Abscissa::Output, Weight::Sense(-1.0), false), rig(0.0)), 0.0);
        assert_eq!(at(wave(Abscissa::Output, Weight::Constant, true), rig(0.0)), 1.0);
    }

    #[test]
    fn knocks_ring_out_and_bursts_end() {
        let mut knocks =
            running(&ReadingError::Knocks { per_minute: 6.0, size_rad: 1e-4, decay_s: 0.05, ring_hz: 0.0 });
        let values: Vec<f64> = (0..600_000).map(|n| knocks.advance(&rig(f64::from(n) * 1e-3)).abs()).collect();
        let struck = values.windows(2).filter(|pair| pair[1] > pair[0]).count();
        assert!((30..90).contains(&struck), "{struck}");
        assert!(values.iter().filter(|value| **value < 1e-9).count() > 500_000);

        let mut bursts = running(&ReadingError::Bursts { per_minute: 6.0, length_s: 0.2, size_rad: 1e-4 });
        let wrong = (0..600_000).filter(|n| bursts.advance(&rig(f64::from(*n) * 1e-3)) != 0.0).count();
        assert!((6_000..20_000).contains(&wrong), "{wrong}");
    }

    #[test]
    fn a_seat_settles_after_a_reversal_into_its_sense_only() {
        let mut seat = running(&ReadingError::Settling { sense: -1.0, size_rad: 1e-4, travel_rad: 1.0 });
        assert_eq!(seat.advance(&rig(0.0)), 0.0);
        let back = RigState { speed_rad_per_s: -1.0, ..rig(0.0) };
        assert!(seat.advance(&back) > 9e-5);
        for _ in 0..999 {
            seat.advance(&back);
        }
        assert!((seat.level / 1e-4 - (-1.0f64).exp()).abs() < 1e-3);
        assert_eq!(seat.advance(&rig(0.0)), 0.0);
    }
}
