//! Bytes for people: errors show what was on the wire.

use std::fmt;

/// Bytes that print as `01 06 02 00`, cut after 64 bytes so that an error stays one readable line.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Hex(pub Vec<u8>);

impl Hex {
    /// Bytes shown before the rest is only counted.
    const SHOWN: usize = 64;
}

impl From<&[u8]> for Hex {
    fn from(bytes: &[u8]) -> Self {
        Self(bytes.to_vec())
    }
}

impl fmt::Display for Hex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, byte) in self.0.iter().take(Self::SHOWN).enumerate() {
            let gap = if n == 0 { "" } else { " " };
            write!(f, "{gap}{byte:02X}")?;
        }
        match self.0.len().checked_sub(Self::SHOWN) {
            Some(rest) if rest > 0 => write!(f, " … and {rest} more"),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for Hex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Hex({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prints_upper_case_pairs() {
        assert_eq!(Hex::from([1u8, 0xAB, 0].as_slice()).to_string(), "01 AB 00");
        assert_eq!(Hex::from([].as_slice()).to_string(), "");
    }

    #[test]
    fn long_frames_are_cut_and_counted() {
        let shown = Hex(vec![0; 70]).to_string();
        assert!(shown.ends_with("… and 6 more"), "{shown}");
    }
}
