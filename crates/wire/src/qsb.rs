//! US Digital QSB quadrature-to-serial readers: ASCII instructions and answers.
//!
//! 230 400 baud, 8N1. An instruction is `W`, `R` or `S` (write, read, stream), two hexadecimal digits of register, and data; an answer is the
//! letter in small, the register, eight digits of data, eight of time when the reader stamps, and a line end. Sources: US Digital's QSB
//! command list as public programs written with its support use it; `docs/wire/qsb.md`.

use thiserror::Error;

/// Line speed, bit/s.
pub const BAUD: u32 = 230_400;

/// Register numbers.
pub mod register {
    /// Quadrature, 0.
    pub const MODE: u8 = 0x00;
    /// Counting: direction, multiplication, modulo.
    pub const MDR0: u8 = 0x03;
    /// Enables the counter.
    pub const MDR1: u8 = 0x04;
    /// Largest count.
    pub const PRESET: u8 = 0x08;
    /// Change of count that makes a streamed line; 0 streams all.
    pub const THRESHOLD: u8 = 0x0B;
    /// Streaming interval.
    pub const INTERVAL: u8 = 0x0C;
    /// Count.
    pub const COUNT: u8 = 0x0E;
    /// Version.
    pub const VERSION: u8 = 0x14;
    /// Line ends and time stamp, [`END_LF`](super::END_LF) and others.
    pub const END_OF_RESPONSE: u8 = 0x15;
}

/// End of response: line feed.
pub const END_LF: u8 = 1 << 0;
/// End of response: carriage return.
pub const END_CR: u8 = 1 << 1;
/// End of response: a 32-bit time stamp goes before it.
pub const END_TIME: u8 = 1 << 2;

/// What a host sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instruction {
    /// Write a register of one byte.
    Write8(u8, u8),
    /// Write a register of two bytes.
    Write16(u8, u16),
    /// Read a register.
    Read(u8),
    /// Stream a register.
    Stream(u8),
}

impl Instruction {
    /// The line to send.
    pub fn line(self) -> String {
        match self {
            Self::Write8(register, value) => format!("W{register:02X}{value:02X}\r\n"),
            Self::Write16(register, value) => format!("W{register:02X}{value:04X}\r\n"),
            Self::Read(register) => format!("R{register:02X}\r\n"),
            Self::Stream(register) => format!("S{register:02X}\r\n"),
        }
    }
}

/// An answer's letter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// To a write.
    Wrote,
    /// To a read.
    Read,
    /// Streamed.
    Streamed,
    /// A refusal.
    Error,
}

/// One answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// Its letter.
    pub kind: Kind,
    /// The register.
    pub register: u8,
    /// Its content; a count is in two's complement.
    pub data: u32,
    /// The reader's time, ticks, when it stamps.
    pub time_ticks: Option<u32>,
}

/// A line that is no answer. Nothing of it is believed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{line:?} is no answer of a QSB: check 230400 8N1 and the reader's end-of-response setting (register 15h)")]
pub struct NoAnswer {
    line: String,
}

impl Answer {
    /// From a line without its end: letter, two, eight and, with a time, eight digits; a `!` may close it.
    ///
    /// # Errors
    /// [`NoAnswer`] for any other form or length: there is no check sum, so form and length are all that can be checked.
    pub fn parse(line: &str) -> Result<Self, NoAnswer> {
        let refuse = || NoAnswer { line: line.chars().take(64).collect() };
        let body = line.strip_suffix('!').unwrap_or(line);
        let (letter, digits) = body.split_at_checked(1).ok_or_else(refuse)?;
        let kind = match letter {
            "w" => Kind::Wrote,
            "r" => Kind::Read,
            "s" => Kind::Streamed,
            "e" => Kind::Error,
            _ => return Err(refuse()),
        };
        let timed = match digits.len() {
            10 => false,
            18 => true,
            _ => return Err(refuse()),
        };
        if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(refuse());
        }
        let number = |range: std::ops::Range<usize>| {
            digits.get(range).and_then(|text| u32::from_str_radix(text, 16).ok()).ok_or_else(refuse)
        };
        Ok(Self {
            kind,
            register: u8::try_from(number(0..2)?).map_err(|_| refuse())?,
            data: number(2..10)?,
            time_ticks: if timed { Some(number(10..18)?) } else { None },
        })
    }

    /// The count, if this is one.
    pub fn count(&self) -> Option<i32> {
        (self.register == register::COUNT && self.kind != Kind::Error).then(|| self.data.cast_signed())
    }
}

/// Runs a counter of 32 bits on without end: counts and time stamps wrap.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwrap {
    last: Option<u32>,
    total: i64,
}

impl Unwrap {
    /// The value that runs on. Steps of more than 2³¹ are taken for steps back.
    pub fn push(&mut self, value: u32) -> i64 {
        self.total = match self.last {
            None => i64::from(value.cast_signed()),
            Some(last) => self.total + i64::from(value.wrapping_sub(last).cast_signed()),
        };
        self.last = Some(value);
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frozen_lines() {
        // If this test fails, do not change the test.
        assert_eq!(Instruction::Write8(register::MODE, 0).line(), "W0000\r\n");
        assert_eq!(Instruction::Write16(register::PRESET, 10_000).line(), "W082710\r\n");
        assert_eq!(Instruction::Write8(register::END_OF_RESPONSE, END_LF | END_CR | END_TIME).line(), "W1507\r\n");
        assert_eq!(Instruction::Stream(register::COUNT).line(), "S0E\r\n");
        let answer = Answer::parse("s0EFFFFFFFE0001A2B3").unwrap();
        assert_eq!((answer.kind, answer.count(), answer.time_ticks), (Kind::Streamed, Some(-2), Some(0x1A2B3)));
        assert_eq!(Answer::parse("r0E00000010!").unwrap().count(), Some(16));
    }

    #[test]
    fn damaged_lines_are_no_answers() {
        let good = "s0EFFFFFFFE0001A2B3";
        for cut in 0..good.len() {
            let outcome = Answer::parse(&good[..cut]);
            // A line cut exactly before its time is a whole line without one; the driver asks for the time and refuses it.
            assert!(outcome.is_err() || (cut == 11 && outcome.unwrap().time_ticks.is_none()), "{cut}");
        }
        for wrong in
            ["x0E00000010", "s0E0000001G", "s0E00000010 ", "s0Eä0000010", "s+E00000010", "s0E00000010s0E00000010"]
        {
            assert!(Answer::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn counts_run_on_over_the_wrap() {
        let mut unwrap = Unwrap::default();
        assert_eq!(
            [0x7FFF_FFFF, 0x8000_0001, 0x7FFF_FFFE].map(|value| unwrap.push(value)),
            [0x7FFF_FFFF, 0x8000_0001, 0x7FFF_FFFE]
        );
    }
}
