//! Times of the serial line: what the simulated wire takes and what a driver has to wait.

use std::time::Duration;

/// Parity bit of a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parity {
    /// No parity bit.
    None,
    /// Even.
    Even,
    /// Odd.
    Odd,
}

/// How characters are sent. RTU always uses 8 data bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LineSettings {
    /// Bits a second.
    pub baud: u32,
    /// Parity bit.
    pub parity: Parity,
    /// Stop bits, 1 or 2.
    pub stop_bits: u8,
}

impl LineSettings {
    /// Data bits of a character.
    pub const DATA_BITS: u8 = 8;

    /// 8 data bits, no parity, `stop_bits` stop bits.
    pub const fn no_parity(baud: u32, stop_bits: u8) -> Self {
        Self { baud, parity: Parity::None, stop_bits }
    }

    /// Bits of a character: start, data, parity, stop.
    pub fn bits_per_character(&self) -> u32 {
        1 + u32::from(Self::DATA_BITS) + u32::from(self.parity != Parity::None) + u32::from(self.stop_bits)
    }
}

/// Time that `bytes` characters take on the line. A line at 0 baud never gets anything across: [`Duration::MAX`].
pub fn frame_time(bytes: usize, settings: &LineSettings) -> Duration {
    bit_time(bytes as u128 * u128::from(settings.bits_per_character()), settings.baud)
}

/// Silence between frames, t3.5 (V1.02 §2.5.1.1): 3.5 characters of 11 bits up to 19200 baud, 1.75 ms above.
pub fn inter_frame_silence(baud: u32) -> Duration {
    // 3.5 * 11 bits = 77 half bits.
    if baud > 19_200 { Duration::from_micros(1750) } else { bit_time(77, baud) / 2 }
}

/// Longest silence inside a frame, t1.5 (V1.02 §2.5.1.1): 1.5 characters up to 19200 baud, 750 µs above.
pub fn inter_character_timeout(baud: u32) -> Duration {
    if baud > 19_200 { Duration::from_micros(750) } else { bit_time(33, baud) / 2 }
}

fn bit_time(bits: u128, baud: u32) -> Duration {
    match (bits * 1_000_000_000).checked_div(u128::from(baud)) {
        Some(nanos) => Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX)),
        None => Duration::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn character_lengths() {
        assert_eq!(LineSettings::no_parity(38_400, 2).bits_per_character(), 11);
        assert_eq!(LineSettings::no_parity(38_400, 1).bits_per_character(), 10);
        assert_eq!(LineSettings { baud: 9600, parity: Parity::Even, stop_bits: 1 }.bits_per_character(), 11);
    }

    #[test]
    fn eight_bytes_at_9600_take_nine_milliseconds() {
        // 8 * 11 / 9600 s = 9.1666 ms
        let time = frame_time(8, &LineSettings::no_parity(9600, 2));
        assert_eq!(time.as_nanos(), 9_166_666);
    }

    #[test]
    fn silences() {
        assert_eq!(inter_frame_silence(9600).as_nanos(), 4_010_416);
        assert_eq!(inter_frame_silence(19_200).as_nanos(), 2_005_208);
        assert_eq!(inter_frame_silence(38_400), Duration::from_micros(1750));
        assert_eq!(inter_character_timeout(115_200), Duration::from_micros(750));
        assert_eq!(inter_frame_silence(0), Duration::MAX / 2);
    }
}
