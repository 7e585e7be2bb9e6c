//! An emulated QSB reader with a clock of its own. Lines: [`wire::qsb`], `docs/wire/qsb.md`.

use wire::qsb::register;

/// Ticks a second of a reader's clock.
const TICKS_HZ: f64 = 512.0;

/// How a reader's clock goes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct QsbClock {
    /// Its time when the rig's is 0, s.
    pub offset_s: f64,
    /// How much faster it goes, parts per million; its ticks are so much shorter.
    pub fast_ppm: f64,
}

/// One reader on one encoder.
#[derive(Debug, Clone)]
pub struct QsbEmulator {
    clock: QsbClock,
    version: u32,
    command: Vec<u8>,
    ends: u8,
    interval_ticks: u64,
    streams: bool,
    next_tick: u64,
    before: (u64, i64),
    counts_from: i64,
    out: Vec<u8>,
}

impl QsbEmulator {
    /// A reader that was switched on with the rig.
    #[must_use]
    pub fn new(clock: QsbClock, version: u32) -> Self {
        Self {
            clock,
            version,
            command: Vec::new(),
            ends: wire::qsb::END_LF | wire::qsb::END_CR,
            interval_ticks: 1,
            streams: false,
            next_tick: 0,
            before: (0, 0),
            counts_from: 0,
            out: Vec::new(),
        }
    }

    /// The reader's time, ticks and their part.
    fn ticks(&self, time_ns: u64) -> f64 {
        (time_ns as f64 * 1e-9 + self.clock.offset_s) * (1.0 + self.clock.fast_ppm * 1e-6) * TICKS_HZ
    }

    /// A cut of its power: settings and count are gone, and its time begins anew.
    pub fn restart(&mut self, time_ns: u64) {
        let clock = QsbClock { offset_s: -(time_ns as f64) * 1e-9, ..self.clock };
        *self = Self { before: self.before, counts_from: self.before.1, ..Self::new(clock, self.version) };
    }

    /// Takes the encoder's count at `time_ns`, and streams what became due since the one before.
    pub fn sample(&mut self, time_ns: u64, count: i64) {
        let (from_ns, from) = std::mem::replace(&mut self.before, (time_ns, count));
        if !self.streams || time_ns <= from_ns {
            return;
        }
        let (before, now) = (self.ticks(from_ns), self.ticks(time_ns));
        while (self.next_tick as f64) <= now {
            let part = ((self.next_tick as f64 - before) / (now - before)).clamp(0.0, 1.0);
            let between = from + ((count - from) as f64 * part).round() as i64 - self.counts_from;
            self.answer('s', register::COUNT, between as u32, self.next_tick);
            self.next_tick += self.interval_ticks;
        }
    }

    fn answer(&mut self, letter: char, register: u8, data: u32, tick: u64) {
        let mut line = format!("{letter}{register:02X}{data:08X}");
        if self.ends & wire::qsb::END_TIME != 0 {
            line += &format!("{:08X}", tick as u32);
        }
        if self.ends & wire::qsb::END_CR != 0 {
            line.push('\r');
        }
        if self.ends & wire::qsb::END_LF != 0 {
            line.push('\n');
        }
        self.out.extend(line.as_bytes());
    }

    /// Takes bytes from the host.
    pub fn receive(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if byte != b'\r' && byte != b'\n' {
                self.command.push(byte);
            } else if !self.command.is_empty() {
                let command = std::mem::take(&mut self.command);
                self.obey(&String::from_utf8_lossy(&command));
            }
        }
    }

    fn obey(&mut self, command: &str) {
        let tick = self.ticks(self.before.0) as u64;
        self.streams = false;
        let number = |digits: Option<&str>| digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let Some(register) = number(command.get(1..3)).and_then(|register| u8::try_from(register).ok()) else {
            self.answer('e', 0, 0, tick);
            return;
        };
        match (command.get(0..1), number(command.get(3..))) {
            (Some("W"), Some(value)) => {
                match register {
                    register::END_OF_RESPONSE => self.ends = value as u8,
                    register::INTERVAL => self.interval_ticks = u64::from(value.max(1)),
                    _ => {}
                }
                self.answer('w', register, value, tick);
            }
            (Some("R"), None) => {
                let data = match register {
                    register::VERSION => self.version,
                    register::COUNT => (self.before.1 - self.counts_from) as u32,
                    _ => 0,
                };
                self.answer('r', register, data, tick);
            }
            (Some("S"), None) if register == register::COUNT => {
                (self.streams, self.next_tick) = (true, tick + 1);
            }
            _ => self.answer('e', register, 0, tick),
        }
    }

    /// Takes what it sends.
    pub fn take_output(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_ticks_follow_its_own_clock() {
        let mut reader = QsbEmulator::new(QsbClock { offset_s: 10.0, fast_ppm: 1e5 }, 7);
        reader.receive(b"W1507\r\nR14\r\nX\r\nS0E\r\n");
        // A count a microsecond for a second: 512 · 1.1 ticks, each at the count of its own instant.
        for n in 0..=1000_u64 {
            reader.sample(n * 1_000_000, (n * 1000).cast_signed());
        }
        let mut bytes = Vec::new();
        reader.take_output(&mut bytes);
        let text = String::from_utf8(bytes).expect("ASCII");
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(&lines[..3], ["w150000000700001600", "r140000000700001600", "e000000000000001600"]);
        let streamed: Vec<_> = lines[3..].iter().map(|line| wire::qsb::Answer::parse(line).expect("whole")).collect();
        assert!((562..=564).contains(&streamed.len()), "{}", streamed.len());
        for answer in streamed {
            let at_s = f64::from(answer.time_ticks.expect("timed")) / 512.0 / 1.1 - 10.0;
            assert!((f64::from(answer.count().expect("a count")) - at_s * 1e6).abs() < 2.0);
        }
    }
}
