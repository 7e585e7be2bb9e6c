//! A recording: sampled angles of two shafts with the conditions they were taken under.
//!
//! The columns are borrowed where their owner has them anyway (a numpy array, a log in memory) and owned otherwise.

mod check;
mod split;

use std::borrow::Cow;
use std::f64::consts::TAU;

use check::{check_column, check_lines, check_sense, check_time};

use crate::measure::{AngleGrid, RunConditions, RunTe};
use crate::{Direction, GearPair};

pub use check::RecordingError;
pub use split::{REVERSAL_RAD, Segment, segments};

/// One value for all samples, or one a sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition<'a> {
    /// Constant over the recording.
    All(f64),
    /// A value a sample.
    Each(Cow<'a, [f64]>),
}

impl Condition<'_> {
    /// The value, or the mean of the values: what the model is evaluated at.
    #[must_use]
    pub fn mean(&self) -> f64 {
        match self {
            Self::All(value) => *value,
            Self::Each(values) => values.iter().sum::<f64>() / values.len() as f64,
        }
    }

    /// The value at a sample; `None` past the end.
    #[must_use]
    pub fn at(&self, sample: usize) -> Option<f64> {
        match self {
            Self::All(value) => Some(*value),
            Self::Each(values) => values.get(sample).copied(),
        }
    }

    fn check(&self, field: &'static str, samples: usize) -> Result<(), RecordingError> {
        match self {
            Self::All(value) if value.is_finite() => Ok(()),
            Self::All(value) => Err(RecordingError::Condition { field, value: *value }),
            Self::Each(values) => check_column(field, values, samples, false),
        }
    }

    fn part(&self, segment: Segment) -> Condition<'_> {
        match self {
            Self::All(value) => Condition::All(*value),
            Self::Each(values) => Condition::Each(Cow::Borrowed(&values[segment.from..segment.to])),
        }
    }

    fn into_owned(self) -> Condition<'static> {
        match self {
            Self::All(value) => Condition::All(value),
            Self::Each(values) => Condition::Each(Cow::Owned(values.into_owned())),
        }
    }
}

impl From<f64> for Condition<'_> {
    fn from(value: f64) -> Self {
        Self::All(value)
    }
}

/// What a recording is made of, not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns<'a> {
    /// Time of the samples, s, increasing. Recordings that are compared share one clock.
    pub time_s: Cow<'a, [f64]>,
    /// Angle of the driver, rad, unwrapped; NaN is a gap.
    pub theta1_rad: Cow<'a, [f64]>,
    /// Angle of the driven shaft, rad, in its own positive sense: it increases where θ1 does; NaN is a gap.
    pub theta2_rad: Cow<'a, [f64]>,
    /// Torque on the driven shaft, N·m.
    pub load_nm: Condition<'a>,
    /// Driver speed, rpm, positive in both senses; 0 = not known.
    pub speed_rpm: Condition<'a>,
    /// The driver's sense; `None` = "auto", taken from the motion.
    pub direction: Option<Direction>,
    /// Lines of the input encoder's disc, where they are known.
    pub input_lines: Option<u64>,
    /// Lines of the output encoder's disc, where they are known.
    pub output_lines: Option<u64>,
}

/// Columns that were checked: equal lengths, at least one sample of both angles, no infinite angle, finite conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording<'a> {
    columns: Columns<'a>,
}

/// The sense that a text names; `None` for "auto", taken from the motion.
///
/// # Errors
/// [`RecordingError::Direction`] for anything but "ccw", "cw" and "auto".
pub fn parse_direction(text: &str) -> Result<Option<Direction>, RecordingError> {
    if text == "auto" {
        return Ok(None);
    }
    text.parse().map(Some).map_err(|_| RecordingError::Direction { given: text.to_owned() })
}

impl<'a> Recording<'a> {
    /// Columns from anywhere.
    ///
    /// # Errors
    /// [`RecordingError`] names field, index and limit: unequal lengths, no sample, a time that is NaN or does not increase,
    /// an infinite angle, a condition that is no number, angles that move against the direction, an encoder of 0 lines.
    pub fn new(columns: Columns<'a>) -> Result<Self, RecordingError> {
        check_time(&columns.time_s)?;
        let recording = Self::of_log(columns)?;
        let columns = &recording.columns;
        if let Some(direction) = columns.direction {
            check_sense("theta1_rad", &columns.theta1_rad, direction)?;
            check_sense("theta2_rad", &columns.theta2_rad, direction)?;
        }
        Ok(recording)
    }

    /// A run of a log: as [`Recording::new`], but its clock and its sense are believed. Whether the clock ran evenly is for
    /// the log's audit to say; a run whose driven shaft slipped backwards is to be analysed, not refused.
    ///
    /// # Errors
    /// [`RecordingError`] for unequal lengths, no sample, an infinite angle, a condition that is no number, an encoder of 0
    /// lines.
    pub fn of_log(columns: Columns<'a>) -> Result<Self, RecordingError> {
        let samples = columns.time_s.len();
        if samples == 0 {
            return Err(RecordingError::Empty);
        }
        check_column("theta1_rad", &columns.theta1_rad, samples, true)?;
        check_column("theta2_rad", &columns.theta2_rad, samples, true)?;
        columns.load_nm.check("load_nm", samples)?;
        columns.speed_rpm.check("speed_rpm", samples)?;
        check_lines("input_lines", columns.input_lines)?;
        check_lines("output_lines", columns.output_lines)?;
        Ok(Self { columns })
    }

    /// The columns.
    #[must_use]
    pub fn columns(&self) -> &Columns<'a> {
        &self.columns
    }

    /// The columns, owned by the recording from now on.
    #[must_use]
    pub fn into_owned(self) -> Recording<'static> {
        let columns = self.columns;
        Recording {
            columns: Columns {
                time_s: Cow::Owned(columns.time_s.into_owned()),
                theta1_rad: Cow::Owned(columns.theta1_rad.into_owned()),
                theta2_rad: Cow::Owned(columns.theta2_rad.into_owned()),
                load_nm: columns.load_nm.into_owned(),
                speed_rpm: columns.speed_rpm.into_owned(),
                ..columns
            },
        }
    }

    /// Number of samples, gaps included; at least 1.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.columns.time_s.len()
    }

    /// Time from the first to the last sample, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let time_s = &self.columns.time_s;
        time_s.last().zip(time_s.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// Turns of the driver between the first and the last sample that are no gap, ≥ 0.
    #[must_use]
    pub fn turns(&self) -> f64 {
        self.ends().map_or(0.0, |(first, last)| {
            let theta1_rad = &self.columns.theta1_rad;
            (theta1_rad[last] - theta1_rad[first]).abs() / TAU
        })
    }

    /// Driver speed, rpm: the mean of what is stated, or where that is 0 (not known) the mean of the motion. 0 where nothing
    /// moves.
    #[must_use]
    pub fn driver_rpm(&self) -> f64 {
        const S_PER_MIN: f64 = 60.0;
        let stated_rpm = self.columns.speed_rpm.mean();
        if stated_rpm != 0.0 {
            return stated_rpm;
        }
        let Some((first, last)) = self.ends() else { return 0.0 };
        let elapsed_s = self.columns.time_s[last] - self.columns.time_s[first];
        if elapsed_s > 0.0 { self.turns() / elapsed_s * S_PER_MIN } else { 0.0 }
    }

    /// First and last sample whose θ1 is no gap.
    fn ends(&self) -> Option<(usize, usize)> {
        let seen = |theta: &f64| theta.is_finite();
        let theta1_rad = &self.columns.theta1_rad;
        theta1_rad.iter().position(seen).zip(theta1_rad.iter().rposition(seen))
    }

    /// Where the recording keeps one sense: whole for a stated direction, else cut where θ1 turns back by more than
    /// [`REVERSAL_RAD`], less what is one gap of θ2. Empty for "auto" without motion.
    #[must_use]
    pub fn segments(&self) -> Vec<Segment> {
        if let Some(direction) = self.columns.direction {
            return vec![Segment { from: 0, to: self.samples(), direction }];
        }
        let mut found = segments(&self.columns.theta1_rad);
        found.retain(|part| self.columns.theta2_rad[part.from..part.to].iter().any(|theta| theta.is_finite()));
        found
    }

    /// The parts of one sense each, in order, with their direction; they borrow the columns.
    #[must_use]
    pub fn split(&self) -> Vec<Recording<'_>> {
        self.segments().into_iter().map(|segment| self.part(segment)).collect()
    }

    fn part(&self, segment: Segment) -> Recording<'_> {
        let columns = &self.columns;
        let samples = segment.from..segment.to;
        Recording {
            columns: Columns {
                time_s: Cow::Borrowed(&columns.time_s[samples.clone()]),
                theta1_rad: Cow::Borrowed(&columns.theta1_rad[samples.clone()]),
                theta2_rad: Cow::Borrowed(&columns.theta2_rad[samples]),
                load_nm: columns.load_nm.part(segment),
                speed_rpm: columns.speed_rpm.part(segment),
                direction: Some(segment.direction),
                input_lines: columns.input_lines,
                output_lines: columns.output_lines,
            },
        }
    }

    /// The sense, where there is one; a stated direction is believed.
    ///
    /// # Errors
    /// [`RecordingError::Reverses`] and [`RecordingError::Still`] for "auto" with more than one sense, or none.
    pub fn one_sense(&self) -> Result<Direction, RecordingError> {
        match self.segments().as_slice() {
            [] => Err(RecordingError::Still { limit_rad: REVERSAL_RAD }),
            [only] => Ok(only.direction),
            [first, rest @ ..] => Err(RecordingError::Reverses { reversals: rest.len(), index: first.to }),
        }
    }

    /// TE of a recording of one sense over the driver's angle, at its mean load and speed; gaps are skipped.
    ///
    /// # Errors
    /// As for [`Recording::one_sense`].
    pub fn te(&self, pair: &GearPair, grid: AngleGrid) -> Result<RunTe, RecordingError> {
        let mut run = self.empty_run(grid)?;
        for (theta1_rad, theta2_rad) in self.columns.theta1_rad.iter().zip(self.columns.theta2_rad.iter()) {
            run.push(pair, *theta1_rad, *theta2_rad);
        }
        Ok(run)
    }

    /// [`Recording::te`] over the driven shaft's angle and revolutions: its mean curve is the synchronous average of the
    /// driven shaft.
    ///
    /// # Errors
    /// As for [`Recording::one_sense`].
    pub fn te_over_driven(&self, pair: &GearPair, grid: AngleGrid) -> Result<RunTe, RecordingError> {
        let mut run = self.empty_run(grid)?;
        for (theta1_rad, theta2_rad) in self.columns.theta1_rad.iter().zip(self.columns.theta2_rad.iter()) {
            run.push_over_driven(pair, *theta1_rad, *theta2_rad);
        }
        Ok(run)
    }

    fn empty_run(&self, grid: AngleGrid) -> Result<RunTe, RecordingError> {
        let conditions = RunConditions {
            direction: self.one_sense()?,
            load_nm: self.columns.load_nm.mean(),
            speed_rpm: self.columns.speed_rpm.mean(),
        };
        Ok(RunTe::new(grid, conditions))
    }
}

#[cfg(test)]
mod tests;
