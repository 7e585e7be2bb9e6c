//! Registers as data: where a quantity sits, how it is stored, in which unit, and who may write it.

use std::borrow::Cow;

use thiserror::Error;

/// How a register stores its number. Names of two-register kinds say which word comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RegisterKind {
    /// One register, unsigned.
    U16,
    /// One register, two's complement.
    I16,
    /// Two registers, unsigned, low word first (Delta).
    U32LowFirst,
    /// Two registers, two's complement, low word first (Delta).
    I32LowFirst,
    /// Two registers, unsigned, high word first (Riden).
    U32HighFirst,
    /// Two registers, two's complement, high word first.
    I32HighFirst,
    /// Two registers, sign (0 plus, else minus) then magnitude (Riden's temperatures).
    SignMagnitude,
}

impl RegisterKind {
    /// Registers it takes.
    pub const fn words(self) -> u16 {
        match self {
            Self::U16 | Self::I16 => 1,
            _ => 2,
        }
    }

    /// Smallest and largest raw number it holds.
    pub const fn limits(self) -> (i64, i64) {
        match self {
            Self::U16 => (0, u16::MAX as i64),
            Self::I16 => (i16::MIN as i64, i16::MAX as i64),
            Self::U32LowFirst | Self::U32HighFirst => (0, u32::MAX as i64),
            Self::I32LowFirst | Self::I32HighFirst => (i32::MIN as i64, i32::MAX as i64),
            Self::SignMagnitude => (-(u16::MAX as i64), u16::MAX as i64),
        }
    }
}

/// Who may write a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Read,
    /// Read and write.
    ReadWrite,
}

/// One quantity of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisterDef {
    /// The maker's name of it, for errors and tables.
    pub name: Cow<'static, str>,
    /// First register.
    pub address: u16,
    /// How it is stored.
    pub kind: RegisterKind,
    /// Value of one raw step, in `unit`.
    pub scale: f64,
    /// Unit of the value; empty for codes and bit fields.
    pub unit: Cow<'static, str>,
    /// Who may write it.
    pub access: Access,
    /// Smallest raw number that the device accepts.
    pub min_raw: i64,
    /// Largest raw number that the device accepts.
    pub max_raw: i64,
}

impl RegisterDef {
    /// A definition whose limits are those of its kind.
    pub const fn new(
        name: &'static str,
        address: u16,
        kind: RegisterKind,
        scale: f64,
        unit: &'static str,
        access: Access,
    ) -> Self {
        let (min_raw, max_raw) = kind.limits();
        Self { name: Cow::Borrowed(name), address, kind, scale, unit: Cow::Borrowed(unit), access, min_raw, max_raw }
    }

    /// The same with the device's own limits, raw and inclusive.
    #[must_use]
    pub const fn limited(mut self, min_raw: i64, max_raw: i64) -> Self {
        self.min_raw = min_raw;
        self.max_raw = max_raw;
        self
    }

    /// Registers it takes.
    pub const fn words(&self) -> u16 {
        self.kind.words()
    }

    /// Limits of the value, in `unit`.
    pub fn limits(&self) -> (f64, f64) {
        (self.min_raw as f64 * self.scale, self.max_raw as f64 * self.scale)
    }

    /// The registers that hold `value`, rounded to the nearest step.
    ///
    /// # Errors
    /// [`RegisterError::OutOfRange`] outside the device's limits (after rounding) or for a value that is no number.
    pub fn encode(&self, value: f64) -> Result<Vec<u16>, RegisterError> {
        let raw = (value / self.scale).round();
        // The comparison is false for NaN, and both limits are far inside the integers a f64 holds.
        if raw >= self.min_raw as f64 && raw <= self.max_raw as f64 {
            self.encode_raw(raw as i64)
        } else {
            Err(self.out_of_range(value))
        }
    }

    /// The registers that hold a raw number.
    ///
    /// # Errors
    /// [`RegisterError::OutOfRange`] outside the device's limits.
    pub fn encode_raw(&self, raw: i64) -> Result<Vec<u16>, RegisterError> {
        let (kind_min, kind_max) = self.kind.limits();
        if raw < self.min_raw.max(kind_min) || raw > self.max_raw.min(kind_max) {
            return Err(self.out_of_range(self.scaled(raw)));
        }
        // In range, so truncation to 16 or 32 bits keeps the two's complement value.
        let (low, high) = (raw as u16, (raw >> 16) as u16);
        Ok(match self.kind {
            RegisterKind::U16 | RegisterKind::I16 => vec![low],
            RegisterKind::U32LowFirst | RegisterKind::I32LowFirst => vec![low, high],
            RegisterKind::U32HighFirst | RegisterKind::I32HighFirst => vec![high, low],
            RegisterKind::SignMagnitude => vec![u16::from(raw < 0), raw.unsigned_abs() as u16],
        })
    }

    /// The value that registers hold, in `unit`.
    ///
    /// # Errors
    /// [`RegisterError::WrongLength`] unless exactly this definition's registers are given.
    pub fn decode(&self, registers: &[u16]) -> Result<f64, RegisterError> {
        Ok(self.scaled(self.decode_raw(registers)?))
    }

    /// The raw number that registers hold.
    ///
    /// # Errors
    /// [`RegisterError::WrongLength`] unless exactly this definition's registers are given.
    pub fn decode_raw(&self, registers: &[u16]) -> Result<i64, RegisterError> {
        let join = |low: u16, high: u16| u32::from(high) << 16 | u32::from(low);
        Ok(match (self.kind, registers) {
            (RegisterKind::U16, &[word]) => i64::from(word),
            (RegisterKind::I16, &[word]) => i64::from(word.cast_signed()),
            (RegisterKind::U32LowFirst, &[low, high]) | (RegisterKind::U32HighFirst, &[high, low]) => {
                i64::from(join(low, high))
            }
            (RegisterKind::I32LowFirst, &[low, high]) | (RegisterKind::I32HighFirst, &[high, low]) => {
                i64::from(join(low, high).cast_signed())
            }
            (RegisterKind::SignMagnitude, &[sign, magnitude]) => {
                if sign == 0 {
                    i64::from(magnitude)
                } else {
                    -i64::from(magnitude)
                }
            }
            _ => {
                return Err(RegisterError::WrongLength {
                    name: self.name.clone(),
                    address: self.address,
                    found: registers.len(),
                    expected: self.words(),
                });
            }
        })
    }

    /// This quantity out of a block of registers that was read from `block_address` on.
    ///
    /// # Errors
    /// [`RegisterError::NotInBlock`] when the block does not cover it.
    pub fn decode_from(&self, block_address: u16, block: &[u16]) -> Result<f64, RegisterError> {
        let words = self
            .address
            .checked_sub(block_address)
            .map(usize::from)
            .and_then(|start| block.get(start..start + usize::from(self.words())));
        match words {
            Some(words) => self.decode(words),
            None => Err(RegisterError::NotInBlock {
                name: self.name.clone(),
                address: self.address,
                block_address,
                block_len: block.len(),
            }),
        }
    }

    /// A raw number in `unit`. Decimal steps divide, so that 1020 steps of 0.01 are 10.2 and not 10.200000000000001.
    fn scaled(&self, raw: i64) -> f64 {
        let steps_per_unit = (1.0 / self.scale).round();
        if steps_per_unit >= 1.0 && (self.scale * steps_per_unit - 1.0).abs() < 1e-12 {
            raw as f64 / steps_per_unit
        } else {
            raw as f64 * self.scale
        }
    }

    fn out_of_range(&self, value: f64) -> RegisterError {
        let (min, max) = self.limits();
        RegisterError::OutOfRange {
            name: self.name.clone(),
            address: self.address,
            value,
            unit: self.unit.clone(),
            min,
            max,
        }
    }
}

/// A value and a register that do not fit each other.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RegisterError {
    /// The device does not accept the value.
    #[error("{name} at {address:04X}h: {value} {unit} is outside {min} to {max} {unit}: choose a value inside")]
    OutOfRange {
        /// Register name.
        name: Cow<'static, str>,
        /// First register.
        address: u16,
        /// The value asked for, in `unit`.
        value: f64,
        /// Its unit.
        unit: Cow<'static, str>,
        /// Smallest value, in `unit`.
        min: f64,
        /// Largest value, in `unit`.
        max: f64,
    },
    /// More or fewer registers than the quantity takes.
    #[error(
        "{name} at {address:04X}h: got {found} registers, it takes {expected}: read the whole quantity in one request"
    )]
    WrongLength {
        /// Register name.
        name: Cow<'static, str>,
        /// First register.
        address: u16,
        /// Registers given.
        found: usize,
        /// Registers it takes.
        expected: u16,
    },
    /// The quantity lies outside the block that was read.
    #[error(
        "{name} at {address:04X}h is not in the block of {block_len} registers from {block_address:04X}h: read a block that covers it"
    )]
    NotInBlock {
        /// Register name.
        name: Cow<'static, str>,
        /// First register.
        address: u16,
        /// First register of the block.
        block_address: u16,
        /// Registers in the block.
        block_len: usize,
    },
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const KINDS: [RegisterKind; 7] = [
        RegisterKind::U16,
        RegisterKind::I16,
        RegisterKind::U32LowFirst,
        RegisterKind::I32LowFirst,
        RegisterKind::U32HighFirst,
        RegisterKind::I32HighFirst,
        RegisterKind::SignMagnitude,
    ];

    fn def(kind: RegisterKind) -> RegisterDef {
        RegisterDef::new("test", 0x0112, kind, 0.1, "rpm", Access::ReadWrite)
    }

    #[test]
    fn word_orders() {
        assert_eq!(def(RegisterKind::I32LowFirst).encode(-1.0).unwrap(), [0xFFF6, 0xFFFF]);
        assert_eq!(def(RegisterKind::U32HighFirst).encode_raw(0x0001_0002).unwrap(), [1, 2]);
        assert_eq!(def(RegisterKind::SignMagnitude).encode_raw(-25).unwrap(), [1, 25]);
        assert_eq!(def(RegisterKind::I16).encode(-0.1).unwrap(), [0xFFFF]);
    }

    #[test]
    fn limits_are_those_of_the_device() {
        let speed = def(RegisterKind::I32LowFirst).limited(-50_000, 50_000);
        assert_eq!(speed.encode(5000.0).unwrap(), [50_000, 0]);
        let error = speed.encode(5000.1).unwrap_err().to_string();
        assert_eq!(error, "test at 0112h: 5000.1 rpm is outside -5000 to 5000 rpm: choose a value inside");
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(speed.encode(value).is_err(), "{value}");
        }
    }

    #[test]
    fn out_of_a_block() {
        let speed = def(RegisterKind::I32LowFirst);
        assert_eq!(speed.decode_from(0x0110, &[0, 0, 50, 0, 7]).unwrap(), 5.0);
        assert!(speed.decode_from(0x0110, &[0, 0, 50]).is_err());
        assert!(speed.decode_from(0x0113, &[0, 0, 0]).is_err());
        assert!(speed.decode(&[1]).is_err());
    }

    proptest! {
        #[test]
        fn raw_numbers_round_trip(kind in prop::sample::select(&KINDS[..]), seed in any::<i64>()) {
            let (min, max) = kind.limits();
            let raw = min + seed.rem_euclid(max - min + 1);
            let words = def(kind).encode_raw(raw).unwrap();
            prop_assert_eq!(words.len(), usize::from(kind.words()));
            prop_assert_eq!(def(kind).decode_raw(&words).unwrap(), raw);
        }

        #[test]
        fn arbitrary_registers_never_panic(kind in prop::sample::select(&KINDS[..]), words in prop::collection::vec(any::<u16>(), 0..4)) {
            let _ = def(kind).decode(&words);
        }
    }
}
