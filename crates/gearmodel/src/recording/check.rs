//! What a recording must be before anything is computed from it.

use crate::Direction;

/// Why columns are no recording, or no recording of one sense: the field, the place and the limit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// Columns of different lengths.
    #[error("{field} has {length} values, time_s has {needed}: all columns need one value a sample")]
    Length {
        /// The column.
        field: &'static str,
        /// Its length.
        length: usize,
        /// The length of time_s.
        needed: usize,
    },
    /// Nothing was recorded.
    #[error("time_s is empty: a recording needs at least 1 sample")]
    Empty,
    /// Every angle is a gap.
    #[error("{field} holds no number, all {length} values are NaN: a recording needs at least 1 sample of both angles")]
    OnlyGaps {
        /// The column.
        field: &'static str,
        /// Its length.
        length: usize,
    },
    /// A time or a condition that is no number, or an infinite angle.
    #[error("{field}[{index}] is {value}: {needed}")]
    NotFinite {
        /// The column.
        field: &'static str,
        /// The sample.
        index: usize,
        /// What stands there.
        value: f64,
        /// What may stand there.
        needed: &'static str,
    },
    /// A condition of the whole recording that is no number.
    #[error("{field} is {value}: a finite number is needed")]
    Condition {
        /// The argument.
        field: &'static str,
        /// The value.
        value: f64,
    },
    /// Time stands still or runs back.
    #[error(
        "time_s[{index}] = {value} s does not follow time_s[{before}] = {previous} s: time must increase; sort the samples \
         or cut the recording there"
    )]
    Time {
        /// The later sample.
        index: usize,
        /// Its predecessor.
        before: usize,
        /// Its time, s.
        value: f64,
        /// Its predecessor's time, s.
        previous: f64,
    },
    /// A direction that does not exist.
    #[error("direction is {given:?}: write \"ccw\", \"cw\" or \"auto\" (taken from the motion)")]
    Direction {
        /// The text given.
        given: String,
    },
    /// The angles move against the stated direction.
    #[error(
        "{field} moves by {travel_rad:.6} rad, but direction is \"{direction}\": both angles increase in a ccw and decrease \
         in a cw recording; change the sign of the angles or the direction"
    )]
    Sense {
        /// The column.
        field: &'static str,
        /// Last less first angle, rad.
        travel_rad: f64,
        /// The stated direction.
        direction: Direction,
    },
    /// An encoder needs lines.
    #[error("{field} is {value}: a whole number of at least 1 is needed, or none where it is not known")]
    Lines {
        /// The argument.
        field: &'static str,
        /// The value.
        value: i64,
    },
    /// The driver turns back where one sense is needed.
    #[error(
        "the recording reverses {reversals} times, first near time_s[{index}]: analyse the parts of split() one by one"
    )]
    Reverses {
        /// How often.
        reversals: usize,
        /// First sample after the first reversal.
        index: usize,
    },
    /// Neither direction nor motion is known.
    #[error("direction is \"auto\", but theta1_rad moves by less than {limit_rad} rad: state \"ccw\" or \"cw\"")]
    Still {
        /// Least travel that shows a direction, rad.
        limit_rad: f64,
    },
}

/// Travel below which noise may look like motion in the other sense, rad.
const CLEAR_TRAVEL_RAD: f64 = 0.1;

/// Passes times that are finite and increase.
pub(super) fn check_time(time_s: &[f64]) -> Result<(), RecordingError> {
    if time_s.is_empty() {
        return Err(RecordingError::Empty);
    }
    if let Some(index) = time_s.iter().position(|time| !time.is_finite()) {
        let needed = "every sample needs a finite time in s";
        return Err(RecordingError::NotFinite { field: "time_s", index, value: time_s[index], needed });
    }
    match time_s.windows(2).position(|pair| pair[1] <= pair[0]) {
        Some(before) => {
            let index = before + 1;
            Err(RecordingError::Time { index, before, value: time_s[index], previous: time_s[before] })
        }
        None => Ok(()),
    }
}

/// Passes a column that is as long as the time and never infinite; NaN is a gap where `gaps` allows it.
pub(super) fn check_column(
    field: &'static str,
    values: &[f64],
    needed: usize,
    gaps: bool,
) -> Result<(), RecordingError> {
    if values.len() != needed {
        return Err(RecordingError::Length { field, length: values.len(), needed });
    }
    let wrong = |value: &f64| if gaps { value.is_infinite() } else { !value.is_finite() };
    if let Some(index) = values.iter().position(wrong) {
        let needed =
            if gaps { "a finite angle in rad is needed, or NaN for a gap" } else { "a finite number is needed" };
        return Err(RecordingError::NotFinite { field, index, value: values[index], needed });
    }
    if gaps && values.iter().all(|value| value.is_nan()) {
        return Err(RecordingError::OnlyGaps { field, length: values.len() });
    }
    Ok(())
}

/// Passes an angle that moves in the stated sense, or hardly at all.
pub(super) fn check_sense(field: &'static str, values: &[f64], direction: Direction) -> Result<(), RecordingError> {
    let mut seen = values.iter().copied().filter(|value| value.is_finite());
    let (Some(first), Some(last)) = (seen.next(), values.iter().rfind(|value| value.is_finite())) else {
        return Ok(());
    };
    let travel_rad = last - first;
    if travel_rad * direction.sign() < -CLEAR_TRAVEL_RAD {
        return Err(RecordingError::Sense { field, travel_rad, direction });
    }
    Ok(())
}

/// Passes an encoder's lines.
pub(super) fn check_lines(field: &'static str, lines: Option<u64>) -> Result<(), RecordingError> {
    if lines == Some(0) { Err(RecordingError::Lines { field, value: 0 }) } else { Ok(()) }
}
