//! Quantities as people type them: a number and its unit (`10Nm`, `0.5 rpm`, `10kHz`, `5..15Nm:5`).
//!
//! A wrong or missing unit is an error that shows the right form; nothing is guessed.

use thiserror::Error;

/// A unit that a quantity accepts, and its size in the quantity's base unit.
struct Unit {
    names: &'static [&'static str],
    factor: f64,
}

/// A kind of quantity: its name, its units and an example for the error.
pub struct Kind {
    name: &'static str,
    units: &'static [Unit],
    example: &'static str,
    /// A bare number is accepted (the option's own name is its unit, as in `--rpm 5`).
    bare: bool,
    /// Values below this are refused.
    minimum: f64,
    /// The minimum itself is refused.
    exclusive: bool,
}

/// Torque; base unit N·m.
pub const TORQUE: Kind = Kind {
    name: "torque",
    units: &[Unit { names: &["Nm", "N·m", "N.m", "N*m"], factor: 1.0 }, Unit { names: &["mNm", "mN·m"], factor: 1e-3 }],
    example: "10Nm",
    bare: false,
    minimum: 0.0,
    exclusive: false,
};

/// Rotational speed; base unit rpm.
pub const SPEED: Kind = Kind {
    name: "speed",
    units: &[Unit { names: &["rpm", "1/min"], factor: 1.0 }],
    example: "5rpm",
    bare: true,
    minimum: 0.0,
    exclusive: true,
};

/// Sample rate; base unit Hz.
pub const RATE: Kind = Kind {
    name: "rate",
    units: &[Unit { names: &["Hz", "S/s"], factor: 1.0 }, Unit { names: &["kHz", "kS/s"], factor: 1e3 }],
    example: "10kHz",
    bare: false,
    minimum: 0.0,
    exclusive: true,
};

/// Angle; base unit rad.
pub const ANGLE: Kind = Kind {
    name: "angle",
    units: &[
        Unit { names: &["rad"], factor: 1.0 },
        Unit { names: &["deg", "°"], factor: std::f64::consts::PI / 180.0 },
    ],
    example: "30deg",
    bare: false,
    minimum: f64::MIN,
    exclusive: false,
};

/// Why a quantity could not be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum QuantityError {
    /// No number at the start.
    #[error("{kind} '{text}' does not begin with a number; write for instance {example}")]
    NoNumber {
        /// Kind of quantity.
        kind: &'static str,
        /// What was typed.
        text: String,
        /// The right form.
        example: &'static str,
    },
    /// The unit is missing.
    #[error("{kind} '{text}' has no unit; write for instance {example} (units: {units})")]
    NoUnit {
        /// Kind of quantity.
        kind: &'static str,
        /// What was typed.
        text: String,
        /// The right form.
        example: &'static str,
        /// The units that are known.
        units: String,
    },
    /// The unit is not one of this kind.
    #[error("unit '{unit}' of '{text}' is not a unit of {kind}; write for instance {example} (units: {units})")]
    WrongUnit {
        /// Kind of quantity.
        kind: &'static str,
        /// What was typed.
        text: String,
        /// The unit that was found.
        unit: String,
        /// The right form.
        example: &'static str,
        /// The units that are known.
        units: String,
    },
    /// The number is outside the range that makes sense.
    #[error("{kind} '{text}' must be a finite number {relation} {minimum}; write for instance {example}")]
    OutOfRange {
        /// Kind of quantity.
        kind: &'static str,
        /// What was typed.
        text: String,
        /// `>` or `>=`.
        relation: &'static str,
        /// The bound.
        minimum: f64,
        /// The right form.
        example: &'static str,
    },
    /// A range whose parts do not fit.
    #[error(
        "range '{text}' must be FIRST..LAST with its unit and :STEP, with FIRST <= LAST, STEP > 0 and at most {limit} values; write for instance 5..15Nm:5"
    )]
    BadRange {
        /// What was typed.
        text: String,
        /// Most values a range may have.
        limit: usize,
    },
}

/// Most values that a range may expand to.
const RANGE_LIMIT: usize = 1000;

impl Kind {
    fn unit_names(&self) -> String {
        let names: Vec<&str> = self.units.iter().map(|unit| unit.names[0]).collect();
        names.join(", ")
    }

    /// Reads one quantity, in the kind's base unit.
    ///
    /// # Errors
    /// [`QuantityError`] when number or unit is missing, wrong or out of range.
    pub fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        let trimmed = text.trim();
        let (value, unit) = self.split(trimmed)?;
        let factor = self.factor(trimmed, unit)?;
        self.check(trimmed, value * factor)
    }

    fn split<'t>(&self, text: &'t str) -> Result<(f64, &'t str), QuantityError> {
        // The longest prefix that is a number: "1e3Hz" is 1000 Hz, "5rpm" is 5 rpm.
        let end = (1..=text.len())
            .rev()
            .filter(|&end| text.is_char_boundary(end))
            .find(|&end| {
                let head = &text[..end];
                head.ends_with(|c: char| c.is_ascii_digit() || c == '.') && head.parse::<f64>().is_ok()
            })
            .ok_or_else(|| QuantityError::NoNumber { kind: self.name, text: text.to_owned(), example: self.example })?;
        let value = text[..end].parse::<f64>().unwrap_or(f64::NAN);
        Ok((value, text[end..].trim()))
    }

    fn factor(&self, text: &str, unit: &str) -> Result<f64, QuantityError> {
        if unit.is_empty() {
            if self.bare {
                return Ok(1.0);
            }
            return Err(QuantityError::NoUnit {
                kind: self.name,
                text: text.to_owned(),
                example: self.example,
                units: self.unit_names(),
            });
        }
        self.units.iter().find(|known| known.names.contains(&unit)).map(|known| known.factor).ok_or_else(|| {
            QuantityError::WrongUnit {
                kind: self.name,
                text: text.to_owned(),
                unit: unit.to_owned(),
                example: self.example,
                units: self.unit_names(),
            }
        })
    }

    fn check(&self, text: &str, value: f64) -> Result<f64, QuantityError> {
        let large_enough = if self.exclusive { value > self.minimum } else { value >= self.minimum };
        if value.is_finite() && large_enough {
            return Ok(value);
        }
        Err(QuantityError::OutOfRange {
            kind: self.name,
            text: text.to_owned(),
            relation: if self.exclusive { ">" } else { ">=" },
            minimum: self.minimum,
            example: self.example,
        })
    }

    /// Reads one quantity, a list (`5Nm,10Nm`) or a range (`5..15Nm:5`, both ends included).
    ///
    /// # Errors
    /// [`QuantityError`] when a part is missing, wrong or out of range.
    pub fn parse_list(&self, text: &str) -> Result<Vec<f64>, QuantityError> {
        let mut values = Vec::new();
        for part in text.split(',') {
            match part.split_once("..") {
                None => values.push(self.parse(part)?),
                Some((first, rest)) => values.extend(self.parse_range(part, first, rest)?),
            }
        }
        Ok(values)
    }

    fn parse_range(&self, text: &str, first: &str, rest: &str) -> Result<Vec<f64>, QuantityError> {
        let bad = || QuantityError::BadRange { text: text.trim().to_owned(), limit: RANGE_LIMIT };
        let (last, step) = rest.split_once(':').ok_or_else(bad)?;
        let (last_value, unit) = self.split(last.trim())?;
        let factor = self.factor(text, unit)?;
        // The unit stands once, behind LAST; FIRST and STEP may repeat it.
        let in_unit = |part: &str| -> Result<f64, QuantityError> {
            let (value, own) = self.split(part.trim())?;
            Ok(value * if own.is_empty() { factor } else { self.factor(text, own)? })
        };
        let (first, last, step) = (in_unit(first)?, last_value * factor, in_unit(step)?);
        self.check(text, first)?;
        self.check(text, last)?;
        // Half a thousandth of a step forgives 0.1 + 0.1 + 0.1 != 0.3.
        let count = ((last - first) / step + 5e-4).floor();
        if !(step > 0.0 && last >= first && count < RANGE_LIMIT as f64) {
            return Err(bad());
        }
        Ok((0..=count as usize).map(|i| tidy(first + step * i as f64)).collect())
    }
}

/// The value to 13 figures, as a person would have written it: 0.3, not 0.1 + 2 · 0.1 = 0.30000000000000004.
#[must_use]
pub fn tidy(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_number_and_unit() {
        assert_eq!(TORQUE.parse("10Nm"), Ok(10.0));
        assert_eq!(TORQUE.parse(" 0.5 N·m "), Ok(0.5));
        assert_eq!(TORQUE.parse("500mNm"), Ok(0.5));
        assert_eq!(SPEED.parse("0.5 rpm"), Ok(0.5));
        assert_eq!(SPEED.parse("5"), Ok(5.0));
        assert_eq!(RATE.parse("10kHz"), Ok(10_000.0));
        assert_eq!(RATE.parse("1e3Hz"), Ok(1000.0));
    }

    #[test]
    fn reads_lists_and_ranges() {
        assert_eq!(TORQUE.parse_list("5..15Nm:5"), Ok(vec![5.0, 10.0, 15.0]));
        assert_eq!(TORQUE.parse_list("0.1..0.3Nm:0.1"), Ok(vec![0.1, 0.2, 0.3]));
        assert_eq!(TORQUE.parse_list("1Nm,500mNm"), Ok(vec![1.0, 0.5]));
        assert!(matches!(TORQUE.parse_list("15..5Nm:5"), Err(QuantityError::BadRange { .. })));
        assert!(matches!(TORQUE.parse_list("5..15Nm:0"), Err(QuantityError::BadRange { .. })));
        assert!(matches!(TORQUE.parse_list("5..15Nm"), Err(QuantityError::BadRange { .. })));
    }

    #[test]
    fn errors_show_the_right_form() {
        for (text, needle) in
            [("10", "no unit"), ("10kg", "'kg'"), ("Nm", "number"), ("-1Nm", ">= 0"), ("1e999Nm", "finite")]
        {
            let said = TORQUE.parse(text).expect_err(text).to_string();
            assert!(said.contains(needle) && said.contains("10Nm"), "{text}: {said}");
        }
        assert!(SPEED.parse("0").is_err());
        assert!(TORQUE.parse("NaNNm").is_err());
    }
}
