//! Magtrol DSP7000 dynamometer controller as current source and torque meter of a brake: ASCII commands and answers.
//!
//! Source: *Magtrol Model DSP7000 Dynamometer Controller, User's Manual*, §7.2.1 (answer to OD), §7.4 (upper case, each command ended by
//! CR LF, one a line), §7.4.2 (OD1, *IDN?), §7.4.7 (I1: 0 to 99.99 % of 1 A; STAT). `docs/wire/dsp7000.md`.

use thiserror::Error;

/// Coil current at 100 %, A (§7.4.7).
pub const FULL_SCALE_A: f64 = 1.0;
/// Largest setting, %.
pub const MAX_PERCENT: f64 = 99.99;

/// What a host sends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Who it is.
    Identify,
    /// Fixed coil current, %.
    CurrentPercent(f64),
    /// Coil current to zero.
    CurrentOff,
    /// Torque regulation off.
    TorqueOff,
    /// Speed, torque and sense.
    Read,
    /// Status flags.
    Status,
}

/// A command or an answer that is not one of the manual's.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Dsp7000Error {
    /// A current that the controller does not take.
    #[error("current {percent} % is outside 0 to {MAX_PERCENT} % of {FULL_SCALE_A} A: choose a value inside")]
    Current {
        /// What was asked.
        percent: f64,
    },
    /// An answer of another form.
    #[error("answer {answer:?} is not {expected}: check the line's speed, and that nothing else talks on it")]
    Answer {
        /// What came.
        answer: String,
        /// What was expected.
        expected: &'static str,
    },
}

impl Command {
    /// The line to send.
    ///
    /// # Errors
    /// [`Dsp7000Error::Current`] outside 0 to [`MAX_PERCENT`].
    pub fn line(self) -> Result<String, Dsp7000Error> {
        Ok(match self {
            Self::Identify => "*IDN?\r\n".into(),
            Self::CurrentPercent(percent) if (0.0..=MAX_PERCENT).contains(&percent) => format!("I1,{percent:.2}\r\n"),
            Self::CurrentPercent(percent) => return Err(Dsp7000Error::Current { percent }),
            Self::CurrentOff => "I1\r\n".into(),
            Self::TorqueOff => "Q1\r\n".into(),
            Self::Read => "OD1\r\n".into(),
            Self::Status => "STAT\r\n".into(),
        })
    }
}

/// Which way the shaft turns, seen onto it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// R.
    Clockwise,
    /// L.
    Counterclockwise,
    /// A: the controller is in alarm and does not say.
    Alarm,
}

/// Answer to OD1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Speed, rpm.
    pub speed_rpm: f64,
    /// Torque, in the unit that the controller is set to.
    pub torque: f64,
    /// Sense of rotation.
    pub sense: Sense,
}

impl Reading {
    /// From an answer without its CR LF: `SddddddTdddd.R`, of fixed length, the speed without leading zeroes.
    ///
    /// # Errors
    /// [`Dsp7000Error::Answer`] for anything else: a cut or merged line is no reading.
    pub fn parse(line: &str) -> Result<Self, Dsp7000Error> {
        let refuse = || Dsp7000Error::Answer { answer: line.into(), expected: "SddddddTddddd and R, L or A (OD1)" };
        let rest = line.strip_prefix('S').ok_or_else(refuse)?;
        let (body, sense) = match rest.char_indices().next_back() {
            Some((at, 'R')) => (&rest[..at], Sense::Clockwise),
            Some((at, 'L')) => (&rest[..at], Sense::Counterclockwise),
            Some((at, 'A')) => (&rest[..at], Sense::Alarm),
            _ => return Err(refuse()),
        };
        let (speed, torque) = body.split_once('T').ok_or_else(refuse)?;
        // Six places of speed and five of torque with its point, so a line that lost a digit is seen.
        if speed.len() != 6 || !(5..=6).contains(&torque.len()) || !torque.contains('.') {
            return Err(refuse());
        }
        let number = |text: &str| -> Result<f64, Dsp7000Error> {
            let text = text.trim();
            let plain = text.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'-'));
            text.parse().ok().filter(|_| plain).ok_or_else(refuse)
        };
        Ok(Self { speed_rpm: number(speed)?, torque: number(torque)?, sense })
    }
}

/// Status flags (§7.4.7, STAT).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status(pub u32);

impl Status {
    /// Alarms of channel 1 and of the whole: external, electrical, water, temperature, airflow, contact; global power and torque.
    pub const ALARMS: u32 = 1 << 4 | 1 << 8 | 1 << 10 | 1 << 12 | 1 << 14 | 1 << 16 | 1 << 29 | 1 << 30;
    /// Temperature alarm of channel 1.
    pub const TEMPERATURE: u32 = 1 << 12;

    /// From an answer without its CR LF: the flags as a decimal number.
    ///
    /// # Errors
    /// [`Dsp7000Error::Answer`] for anything else.
    pub fn parse(line: &str) -> Result<Self, Dsp7000Error> {
        let digits = line.trim();
        let plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        digits
            .parse()
            .ok()
            .filter(|_| plain)
            .map(Self)
            .ok_or_else(|| Dsp7000Error::Answer { answer: line.into(), expected: "a number of 32 flags (STAT)" })
    }

    /// Whether any of these is set.
    pub fn any(self, bits: u32) -> bool {
        self.0 & bits != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frozen_lines() {
        // If this test fails, do not change the test.
        let lines = [
            (Command::Identify, "*IDN?\r\n"),
            (Command::CurrentPercent(12.345), "I1,12.35\r\n"),
            (Command::CurrentPercent(0.0), "I1,0.00\r\n"),
            (Command::CurrentOff, "I1\r\n"),
            (Command::TorqueOff, "Q1\r\n"),
            (Command::Read, "OD1\r\n"),
            (Command::Status, "STAT\r\n"),
        ];
        for (command, line) in lines {
            assert_eq!(command.line().unwrap(), line);
        }
        for percent in [-0.01, 100.0, f64::NAN] {
            assert!(Command::CurrentPercent(percent).line().is_err());
        }
    }

    #[test]
    fn readings_of_the_manuals_form() {
        let reading = Reading::parse("S  1234T12.34R").unwrap();
        assert_eq!((reading.speed_rpm, reading.torque, reading.sense), (1234.0, 12.34, Sense::Clockwise));
        assert_eq!(Reading::parse("S     5T0.123L").unwrap().sense, Sense::Counterclockwise);
        assert_eq!(Reading::parse("S     0T0.000A").unwrap().sense, Sense::Alarm);
    }

    #[test]
    fn damaged_lines_are_no_readings() {
        let good = "S  1234T12.34R";
        for cut in 0..good.len() {
            assert!(Reading::parse(&good[..cut]).is_err(), "{}", &good[..cut]);
            let mut shorter = good.to_owned();
            shorter.remove(cut);
            // One digit of torque may be missing from a six-place field, and nothing else.
            assert!(Reading::parse(&shorter).is_err(), "{shorter}");
        }
        for wrong in ["", "S", "S  1234T12.34RS  1234T12.34R", "S  12e4T12.34R", "S   nanTinf..R", "Sä 1234T12.34R"] {
            assert!(Reading::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn flags() {
        assert!(Status::parse("4096").unwrap().any(Status::TEMPERATURE));
        assert!(!Status::parse("2").unwrap().any(Status::ALARMS));
        assert!(Status::parse("-1").is_err() && Status::parse("").is_err() && Status::parse("4294967296").is_err());
    }
}
