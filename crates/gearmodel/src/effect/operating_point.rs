//! Where and when a residual was seen: everything that an effect's trace may depend on.

use super::Shaft;

/// One place in a campaign.
#[derive(Clone, Copy, Debug, Default)]
pub struct OperatingPoint {
    /// Driver angle θ1, rad.
    pub theta1_rad: f64,
    /// Standard deviation of the driver angles of the samples that it stands for, rad.
    pub spread_rad: f64,
    /// Driven angle, rad.
    pub theta2_rad: f64,
    /// Driving sense: +1 ccw, −1 cw.
    pub sense: f64,
    /// i21(θ1).
    pub ratio: f64,
    /// Driven radius r2, mm.
    pub r2_mm: f64,
    /// Effective pressure angle of the driving flank α ∓ μ, rad.
    pub pressure_rad: f64,
    /// Driven base arm A = r2 cos(α ∓ μ), mm.
    pub arm_mm: f64,
    /// Arc rolled since tooth 0 of the driving flank passed the pitch point, in pitches.
    pub pitches: f64,
    /// Pitches a radian of the driver there.
    pub pitches_per_rad: f64,
    /// Load on the driven shaft, N·m.
    pub load_nm: f64,
    /// Driver speed, signed, rad/s.
    pub speed_rad_per_s: f64,
    /// Time since the campaign's earliest sample, s.
    pub time_s: f64,
    /// Way of the driver since then in either sense, revolutions.
    pub way_rev: f64,
    /// Run's number.
    pub run: usize,
    /// Signed revolutions driven so far at each of the plan's loads.
    pub revolutions_by_load: RevolutionsByLoad,
}

/// Most distinct loads whose revolutions are booked apart.
pub const MOST_LOADS: usize = 8;

/// Signed driver revolutions so far, by load: what carried-over slip is computed from.
#[derive(Clone, Copy, Debug, Default)]
pub struct RevolutionsByLoad {
    /// Loads, N·m.
    pub load_nm: [f64; MOST_LOADS],
    /// Revolutions, ccw positive.
    pub signed_rev: [f64; MOST_LOADS],
    /// Revolutions in either sense.
    pub way_rev: [f64; MOST_LOADS],
}

impl RevolutionsByLoad {
    /// No revolutions yet at these loads, of which the first [`MOST_LOADS`] are booked apart.
    #[must_use]
    pub fn at_loads(loads_nm: &[f64]) -> Self {
        let mut revolutions = Self::default();
        for (slot, load) in revolutions.load_nm.iter_mut().zip(loads_nm) {
            *slot = *load;
        }
        revolutions
    }

    /// Books signed revolutions at the load nearest to that under which they were driven.
    pub fn turn(&mut self, load_nm: f64, revolutions: f64) {
        let slot = nearest_level(&self.load_nm, load_nm);
        self.signed_rev[slot] += revolutions;
        self.way_rev[slot] += revolutions.abs();
    }

    /// Revolutions in either sense at all loads.
    #[must_use]
    pub fn total_way_rev(&self) -> f64 {
        self.way_rev.iter().sum()
    }
}

/// Place of the level nearest to a value; 0 where there is none.
#[must_use]
pub fn nearest_level(levels: &[f64], value: f64) -> usize {
    (0..levels.len()).min_by(|a, b| (levels[*a] - value).abs().total_cmp(&(levels[*b] - value).abs())).unwrap_or(0)
}

impl OperatingPoint {
    /// Angle of a shaft, rad.
    #[must_use]
    pub fn angle_rad(&self, shaft: Shaft) -> f64 {
        match shaft {
            Shaft::Input => self.theta1_rad,
            Shaft::Output => self.theta2_rad,
        }
    }

    /// Columns gain·sin nθ and gain·cos nθ over a shaft's angle.
    pub fn wave(&self, shaft: Shaft, order: f64, gain: f64, row: &mut [f64]) {
        let (sin, cos) = (order * self.angle_rad(shaft)).sin_cos();
        row[0] = gain * sin;
        row[1] = gain * cos;
    }

    /// TE of a reading error sin nθ and cos nθ of a shaft's encoder: the input encoder's is seen through the ratio, with the other
    /// sign.
    pub fn reading_error(&self, encoder: Shaft, order: f64, row: &mut [f64]) {
        let gain = match encoder {
            Shaft::Input => -self.ratio,
            Shaft::Output => 1.0,
        };
        self.wave(encoder, order, gain, row);
    }

    /// Takes angles and all that follows from them from another station; condition and time stay.
    pub fn take_angles_of(&mut self, other: &Self) {
        *self = Self {
            spread_rad: self.spread_rad,
            load_nm: self.load_nm,
            speed_rad_per_s: self.speed_rad_per_s,
            time_s: self.time_s,
            way_rev: self.way_rev,
            run: self.run,
            revolutions_by_load: self.revolutions_by_load,
            ..*other
        };
    }

    /// Moves it to a little further along the driver's turn than `from`, as far as the teeth see it: angle and pitches.
    pub fn move_from(&mut self, from: &Self, step_rad: f64) {
        self.theta1_rad = from.theta1_rad + step_rad;
        self.pitches = from.pitches + step_rad * from.pitches_per_rad;
    }
}

/// How fine the trace of an effect is against the segments of angle over which samples are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grain {
    /// As good as constant over them: taken at their middle.
    Smooth,
    /// Bent over them: taken on both sides of the middle, which gives the mean to the third order.
    Fine,
    /// Jumps: taken at many places.
    Sharp,
}

impl Grain {
    /// Where a trace is taken, in standard deviations of the samples' angles.
    #[must_use]
    pub fn places(self) -> &'static [f64] {
        match self {
            Self::Smooth => &[0.0],
            Self::Fine => &[-1.0, 1.0],
            // Middles of six equal parts of a box with this standard deviation, which is √12 wide.
            Self::Sharp => &[-1.443_376, -0.866_025, -0.288_675, 0.288_675, 0.866_025, 1.443_376],
        }
    }
}

/// What the recordings cover.
#[derive(Clone, Debug, Default)]
pub struct MeasurementPlan {
    /// Distinct loads, N·m, ascending.
    pub loads_nm: Vec<f64>,
    /// Distinct driver speeds, rad/s, ascending.
    pub speeds_rad_per_s: Vec<f64>,
    /// Senses seen: ccw, cw.
    pub senses: [bool; 2],
    /// From the earliest to the latest sample, s.
    pub duration_s: f64,
    /// Runs.
    pub runs: usize,
    /// When each begins, s since the campaign's earliest sample.
    pub starts_s: Vec<f64>,
    /// Revolutions of the driver in all.
    pub revolutions: f64,
    /// Part of its turn that each shaft covers, at most 1: input, output.
    pub turns: [f64; 2],
}
