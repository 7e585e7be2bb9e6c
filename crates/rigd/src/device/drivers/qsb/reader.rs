//! One QSB reader's stream: bytes to samples that can be believed. A line has no check sum, so form, time and motion are what it is judged by.

use std::collections::VecDeque;

use wire::qsb::register::COUNT;
use wire::qsb::{Answer, Kind, Unwrap};

use crate::device::two_clocks::{ClockError, ClockFit};

/// A reader's time step, s: its stamp counts 1/512 s (US Digital's QSB demonstration program: "every 1.95 milliseconds").
pub const TICK_S: f64 = 1.0 / 512.0;
/// The same in ns, exactly.
pub const TICK_NS: u64 = 1_953_125;

/// Longest line that is kept while its end is awaited; a whole one has 20 characters.
const LONGEST_LINE: usize = 64;
/// A shaft is taken to accelerate by no more than this, rad/s²: a drive's ramp and an elliptical pair together stay far below.
const ACCELERATION_RAD_PER_S2: f64 = 300.0;
/// Counts that quantisation and flicker of an edge may move a line, either way.
const FLICKER_COUNTS: f64 = 4.0;
/// Longest step of time that is believed, ticks.
const LONGEST_STEP_TICKS: i64 = 256;
/// Lines in a row that are not believed before the reader itself is not.
const SUSPECTS: u32 = 4;
/// Lines that agree before later ones are judged by them.
const FEWEST: usize = 3;
/// Arrivals that a fit looks back on: a minute at the fastest interval.
const WINDOW: usize = 30_720;

/// A line that passed every test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// The reader's time, ticks.
    pub ticks: i64,
    /// Its count.
    pub count: i64,
}

/// The reader's counts or time have jumped for good.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jumped {
    /// The last sample that was believed.
    pub last: Sample,
    /// What it says now.
    pub now: Sample,
}

/// One reader.
#[derive(Debug)]
pub struct Reader {
    interval_ticks: i64,
    counts_per_rad: f64,
    line: Vec<u8>,
    ticks: Unwrap,
    counts: Unwrap,
    before: Option<Sample>,
    last: Option<Sample>,
    believed: usize,
    suspects: u32,
    arrivals: VecDeque<(f64, f64)>,
    /// Answers to writes and reads.
    pub answers: VecDeque<Answer>,
    /// What was streamed and is believed, in order.
    pub samples: VecDeque<Sample>,
    /// Lines that were not believed.
    pub refused: u64,
}

impl Reader {
    /// A reader that streams every `interval_ticks`, of an encoder with these counts a revolution.
    #[must_use]
    pub fn new(interval_ticks: u16, counts_per_rev: u64) -> Self {
        Self {
            interval_ticks: i64::from(interval_ticks.max(1)),
            counts_per_rad: counts_per_rev as f64 / std::f64::consts::TAU,
            line: Vec::new(),
            ticks: Unwrap::default(),
            counts: Unwrap::default(),
            before: None,
            last: None,
            believed: 0,
            suspects: 0,
            arrivals: VecDeque::new(),
            answers: VecDeque::new(),
            samples: VecDeque::new(),
            refused: 0,
        }
    }

    /// Forgets what was streamed before.
    pub fn begin(&mut self) {
        (self.ticks, self.counts, self.before, self.last) = (Unwrap::default(), Unwrap::default(), None, None);
        (self.believed, self.suspects, self.refused) = (0, 0, 0);
        self.samples.clear();
        self.arrivals.clear();
    }

    /// Takes bytes that arrived at `arrived_s` of the host's clock.
    ///
    /// # Errors
    /// [`Jumped`] when several lines in a row do not go on from those before: the reader began anew, or its line is bad.
    pub fn feed(&mut self, bytes: &[u8], arrived_s: f64) -> Result<(), Jumped> {
        for &byte in bytes {
            if byte != b'\r' && byte != b'\n' {
                self.line.push(byte);
                if self.line.len() > LONGEST_LINE {
                    self.line.clear();
                    self.refused += 1;
                }
                continue;
            }
            if self.line.is_empty() {
                continue;
            }
            let line = std::mem::take(&mut self.line);
            match std::str::from_utf8(&line).ok().and_then(|text| Answer::parse(text).ok()) {
                // A streamed line without its time is one that was cut, and refused below.
                Some(Answer { kind: Kind::Streamed, register: COUNT, data, time_ticks: Some(ticks) }) => {
                    self.take(ticks, data, arrived_s)?;
                }
                Some(answer) if answer.kind != Kind::Streamed => self.answers.push_back(answer),
                _ => self.refused += 1,
            }
        }
        Ok(())
    }

    fn take(&mut self, ticks: u32, count: u32, arrived_s: f64) -> Result<(), Jumped> {
        // Both are only run on by a line that is believed.
        let (mut run_ticks, mut run_counts) = (self.ticks, self.counts);
        let sample = Sample { ticks: run_ticks.push(ticks), count: run_counts.push(count) };
        if !self.plausible(sample) {
            self.refused += 1;
            self.suspects += 1;
            if self.believed < FEWEST {
                // Nothing yet says which of them was wrong.
                self.begin_at(ticks, count, arrived_s);
                return Ok(());
            }
            return match self.last {
                Some(last) if self.suspects >= SUSPECTS => Err(Jumped { last, now: sample }),
                _ => Ok(()),
            };
        }
        (self.ticks, self.counts, self.suspects) = (run_ticks, run_counts, 0);
        self.book(sample, arrived_s);
        Ok(())
    }

    fn begin_at(&mut self, ticks: u32, count: u32, arrived_s: f64) {
        let refused = self.refused;
        self.begin();
        self.refused = refused;
        let sample = Sample { ticks: self.ticks.push(ticks), count: self.counts.push(count) };
        self.book(sample, arrived_s);
    }

    fn book(&mut self, sample: Sample, arrived_s: f64) {
        self.before = self.last.replace(sample);
        self.believed += 1;
        self.samples.push_back(sample);
        self.arrivals.push_back((sample.ticks as f64, arrived_s));
        if self.arrivals.len() > WINDOW {
            self.arrivals.pop_front();
        }
    }

    /// Whether a shaft can have got from the samples before to this one.
    ///
    /// From the mean speed v of the step before (length s), n = c + v·t departs after a step t by a·t·(t + s)/2 at most.
    fn plausible(&self, now: Sample) -> bool {
        let Some(last) = self.last else { return true };
        let step = now.ticks - last.ticks;
        if step <= 0 || step % self.interval_ticks != 0 || step > LONGEST_STEP_TICKS {
            return false;
        }
        let Some(before) = self.before else { return true };
        let (t, s) = (step as f64, (last.ticks - before.ticks) as f64);
        let expected = (last.count - before.count) as f64 * t / s;
        let motion = ACCELERATION_RAD_PER_S2 * self.counts_per_rad * t * (t + s) / 2.0 * TICK_S * TICK_S;
        // A difference of counts is exact where it is small, and far too large where it is not.
        let departs = now.count.saturating_sub(last.count) as f64 - expected;
        departs.abs() <= motion + FLICKER_COUNTS * (1.0 + t / s)
    }

    /// The reader's clock against the host's, by the arrivals of the last minute.
    ///
    /// # Errors
    /// [`ClockError`] while there are too few.
    pub fn fit(&mut self) -> Result<ClockFit, ClockError> {
        ClockFit::of(self.arrivals.make_contiguous())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS_PER_REV: u64 = 40_000;

    fn line(ticks: u32, count: i32) -> String {
        format!("s0E{:08X}{ticks:08X}\r\n", count.cast_unsigned())
    }

    fn reader() -> Reader {
        Reader::new(1, COUNTS_PER_REV)
    }

    /// A steady shaft: 20 counts a tick.
    fn steady(reader: &mut Reader, ticks: std::ops::Range<u32>) {
        for n in ticks {
            reader.feed(line(n, n.cast_signed() * 20).as_bytes(), f64::from(n) * TICK_S).expect("steady");
        }
    }

    #[test]
    fn damaged_swapped_and_repeated_lines_are_not_believed() {
        let mut reader = reader();
        steady(&mut reader, 0..50);
        for wrong in [
            // A digit of the count, of the time; count and time changed over; a line again; one of before; cut; glued.
            "s0E000013E800000032\r\n".to_owned(),
            line(50 + 0x1000, 1000),
            line(1000, 50),
            line(49, 980),
            line(10, 200),
            "s0E000003E8\r\n".to_owned(),
            "s0E000003E8000000s0E\r\n".to_owned(),
            "s0F000003E800000032\r\n".to_owned(),
        ] {
            let before = (reader.samples.len(), reader.refused);
            reader.feed(wrong.as_bytes(), 0.1).expect("one is no jump");
            assert_eq!((reader.samples.len(), reader.refused), (before.0, before.1 + 1), "{wrong:?}");
            // A good one between them.
            let n = reader.samples.len() as u32;
            steady(&mut reader, n..n + 1);
            assert_eq!(reader.samples.len(), before.0 + 1);
        }
    }

    #[test]
    fn a_line_that_is_missing_is_a_step_of_time_and_a_restart_is_a_jump() {
        let mut reader = reader();
        steady(&mut reader, 0..50);
        steady(&mut reader, 55..60);
        assert_eq!((reader.samples.len(), reader.refused), (55, 0));
        let outcome = (0..10).find_map(|n| reader.feed(line(n, 0).as_bytes(), 1.0).err());
        assert_eq!(outcome.expect("a jump").last, Sample { ticks: 59, count: 1180 });
    }

    #[test]
    fn a_first_line_that_is_wrong_does_not_keep_the_right_ones_out() {
        let mut reader = reader();
        reader.feed(line(0xF000_0000, 77).as_bytes(), 0.0).expect("taken");
        steady(&mut reader, 5..40);
        assert_eq!(reader.samples.len(), 35);
    }

    #[test]
    fn a_ramp_is_believed_and_bytes_may_come_in_any_pieces() {
        let mut reader = reader();
        // 100 rad/s² from rest, and back through 0.
        let count = |n: u32| {
            let t = f64::from(n) * TICK_S;
            let angle = if t < 0.2 { 50.0 * t * t } else { 2.0 + 20.0 * (t - 0.2) - 50.0 * (t - 0.2).powi(2) };
            (angle * COUNTS_PER_REV as f64 / std::f64::consts::TAU).round() as i32
        };
        let text: String = (0..300).map(|n| line(n, count(n))).collect();
        for piece in text.as_bytes().chunks(7) {
            reader.feed(piece, 0.0).expect("a ramp");
        }
        assert_eq!((reader.samples.len(), reader.refused), (300, 0));
    }
}
