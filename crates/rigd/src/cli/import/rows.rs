//! Rows of a table as samples: which column is what, and what may stand in it.

use std::path::{Path, PathBuf};

use gearmodel::Direction;

use super::error::ImportError;

/// One row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Line of a CSV file, row of a Parquet file, counted from 1.
    pub number: u64,
    /// Time as the table states it, ns.
    pub time_ns: u64,
    /// Angle of the driver, rad; `None` is a sample that was lost.
    pub angles_rad: Option<[f64; 2]>,
    /// Conditions of the run.
    pub conditions: Conditions,
}

/// Conditions that hold through a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The driver's sense.
    pub direction: Direction,
    /// Load set-point, N·m.
    pub load_nm: f64,
    /// Speed set-point, rpm, 0 = not known.
    pub speed_rpm: f64,
}

/// Conditions stated on the command line, in place of columns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stated {
    /// The driver's sense.
    pub direction: Option<Direction>,
    /// Load, N·m.
    pub load_nm: Option<f64>,
    /// Speed, rpm.
    pub speed_rpm: Option<f64>,
}

/// What stands in a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// Nothing.
    Empty,
    /// A number that was stored as one.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code, reason = "CSV knows texts alone"))]
    Number(f64),
    /// A text, of a number or of a sense.
    Text(&'a str),
}

impl Cell<'_> {
    fn number(self) -> Option<f64> {
        match self {
            Self::Empty => None,
            Self::Number(value) => Some(value),
            Self::Text(text) => text.parse().ok(),
        }
    }

    fn time_ns(self) -> Option<u64> {
        match self {
            Self::Text(text) => decimal_ns(text).or_else(|| seconds_ns(text.parse().ok()?)),
            _ => seconds_ns(self.number()?),
        }
    }

    fn show(self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Number(value) => value.to_string(),
            Self::Text(text) => text.to_owned(),
        }
    }
}

const NS_PER_S: u64 = 1_000_000_000;

fn seconds_ns(value_s: f64) -> Option<u64> {
    let ns = (value_s * NS_PER_S as f64).round();
    // 2⁶³ ns are 292 years.
    (0.0..9.2e18).contains(&ns).then_some(ns as u64)
}

/// A decimal number of seconds in ns without the rounding of an f64, which is 0.1 µs at today's Unix time.
fn decimal_ns(text: &str) -> Option<u64> {
    let text = text.strip_prefix('+').unwrap_or(text);
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if (whole.is_empty() && fraction.is_empty()) || !digits(whole) || !digits(fraction) {
        return None;
    }
    let seconds: u64 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
    let nine: String = fraction.chars().chain(std::iter::repeat('0')).take(9).collect();
    let up = u64::from(fraction.as_bytes().get(9).is_some_and(|digit| *digit >= b'5'));
    seconds.checked_mul(NS_PER_S)?.checked_add(nine.parse::<u64>().ok()? + up)
}

/// Which field is what.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    path: PathBuf,
    time: usize,
    theta1: usize,
    theta2: usize,
    load: Option<usize>,
    speed: Option<usize>,
    direction: Option<usize>,
    stated: Stated,
    /// Columns that mean nothing here.
    pub ignored: Vec<String>,
}

const COLUMNS: [&str; 6] = ["time_s", "theta1_rad", "theta2_rad", "load_nm", "speed_rpm", "direction"];

impl Layout {
    /// The layout of a table with these columns.
    ///
    /// # Errors
    /// [`ImportError`] for a column that is missing or stands twice.
    pub fn of(path: &Path, names: &[String], stated: Stated) -> Result<Self, ImportError> {
        let find = |column: &'static str| {
            let mut places = names.iter().enumerate().filter(|(_, name)| name.trim() == column).map(|(place, _)| place);
            let first = places.next();
            if places.next().is_some() {
                return Err(ImportError::TwoColumns { path: path.into(), column });
            }
            Ok(first)
        };
        let need = |column: &'static str, advice: &'static str| {
            find(column)?.ok_or_else(|| ImportError::NoColumn {
                path: path.into(),
                column,
                found: if names.is_empty() { "none".into() } else { names.join(", ") },
                advice,
            })
        };
        let unless = |given: bool, column: &'static str, advice: &'static str| {
            if given { Ok(None) } else { need(column, advice).map(Some) }
        };
        let named = "name the columns time_s, theta1_rad, theta2_rad, with times in s and angles in rad";
        Ok(Self {
            path: path.into(),
            time: need(COLUMNS[0], named)?,
            theta1: need(COLUMNS[1], named)?,
            theta2: need(COLUMNS[2], named)?,
            load: unless(stated.load_nm.is_some(), COLUMNS[3], "add it, or state --load, as --load 10Nm")?,
            speed: unless(stated.speed_rpm.is_some(), COLUMNS[4], "add it, or state --rpm, as --rpm 5")?,
            direction: unless(stated.direction.is_some(), COLUMNS[5], "add it, or state --direction ccw or cw")?,
            stated,
            ignored: names.iter().filter(|name| !COLUMNS.contains(&name.trim())).cloned().collect(),
        })
    }

    /// A row from its fields.
    ///
    /// # Errors
    /// [`ImportError::Value`] names row, column and value.
    pub fn row<'a>(&self, number: u64, cell: impl Fn(usize) -> Cell<'a>) -> Result<Row, ImportError> {
        let refuse = |column: &'static str, cell: Cell<'_>, needed: &'static str| ImportError::Value {
            path: self.path.clone(),
            row: number,
            column,
            value: cell.show(),
            needed,
        };
        let at = cell(self.time);
        let time_ns = at.time_ns().ok_or_else(|| refuse(COLUMNS[0], at, "a time in s of 0 or more"))?;
        // An angle that is empty or NaN is a sample that was lost.
        let angle = |place: usize, column: &'static str| match cell(place) {
            Cell::Empty => Ok(None),
            cell => match cell.number() {
                Some(value) if value.is_nan() => Ok(None),
                Some(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(refuse(column, cell, "a finite angle in rad (or empty for a sample that was lost)")),
            },
        };
        let (theta1, theta2) = (angle(self.theta1, COLUMNS[1])?, angle(self.theta2, COLUMNS[2])?);
        let condition = |given: Option<f64>, place: Option<usize>, column: &'static str, needed: &'static str| {
            let cell = place.map_or(Cell::Empty, &cell);
            given
                .or_else(|| cell.number())
                .filter(|value| value.is_finite() && *value >= 0.0)
                .ok_or_else(|| refuse(column, cell, needed))
        };
        let load_nm = condition(self.stated.load_nm, self.load, COLUMNS[3], "a load in N·m of 0 or more")?;
        let speed_rpm =
            condition(self.stated.speed_rpm, self.speed, COLUMNS[4], "a speed in rpm of 0 (not known) or more")?;
        let sense = self.direction.map_or(Cell::Empty, &cell);
        let direction = match (self.stated.direction, sense) {
            (Some(direction), _) => direction,
            (None, Cell::Text(text)) => text.parse().map_err(|_| refuse(COLUMNS[5], sense, "ccw or cw"))?,
            (None, _) => return Err(refuse(COLUMNS[5], sense, "ccw or cw")),
        };
        Ok(Row {
            number,
            time_ns,
            angles_rad: theta1.zip(theta2).map(|(theta1, theta2)| [theta1, theta2]),
            conditions: Conditions { direction, load_nm, speed_rpm },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_times_are_exact_to_the_nanosecond() {
        assert_eq!(decimal_ns("1763766000.0001"), Some(1_763_766_000_000_100_000));
        assert_eq!(decimal_ns("0.30000000000000004"), Some(300_000_000));
        assert_eq!(decimal_ns(".5"), Some(500_000_000));
        assert_eq!(decimal_ns("0.9999999999"), Some(1_000_000_000));
        assert_eq!(Cell::Text("1e-3").time_ns(), Some(1_000_000));
        for wrong in ["", ".", "-1", "1,5", "x", "NaN", "1e300"] {
            assert_eq!(Cell::Text(wrong).time_ns(), None, "{wrong}");
        }
    }

    #[test]
    fn rows_are_read_by_name_and_refused_by_place() {
        let names: Vec<String> = ["direction", "theta2_rad", "note", "theta1_rad", "time_s"].map(String::from).to_vec();
        let stated = Stated { load_nm: Some(10.0), speed_rpm: Some(5.0), ..Stated::default() };
        let layout = Layout::of(Path::new("t.csv"), &names, stated).unwrap();
        assert_eq!(layout.ignored, ["note"]);
        let fields = |fields: [&'static str; 5]| move |place: usize| Cell::Text(fields[place]);
        let row = layout.row(2, fields(["cw", "0.5", "", "-1e-3", "0.1"])).unwrap();
        assert_eq!(row.angles_rad, Some([-1e-3, 0.5]));
        assert_eq!((row.conditions.direction, row.conditions.load_nm), (Direction::Cw, 10.0));
        assert_eq!(layout.row(2, fields(["cw", "nan", "", "1", "0"])).unwrap().angles_rad, None);
        let said = layout.row(7, fields(["up", "0", "", "0", "0"])).unwrap_err().to_string();
        assert!(said.contains("t.csv, row 7, column direction: 'up'"), "{said}");
        let said = Layout::of(Path::new("t.csv"), &names, Stated::default()).unwrap_err().to_string();
        assert!(said.contains("load_nm") && said.contains("--load"), "{said}");
    }
}
