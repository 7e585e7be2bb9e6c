//! Zig-zag LEB128: small differences of either sign take one byte.

/// Longest encoding of a 32-bit number.
pub(super) const MAX_LEN: usize = 5;

/// 0, −1, 1, −2, … as 0, 1, 2, 3, …
fn zigzag(value: i32) -> u32 {
    ((value << 1) ^ (value >> 31)).cast_unsigned()
}

fn unzigzag(value: u32) -> i32 {
    (value >> 1).cast_signed() ^ -((value & 1).cast_signed())
}

/// Writes `values` from `at` on and returns the end. The caller has made room for [`MAX_LEN`] bytes a value.
pub(super) fn write(out: &mut [u8], mut at: usize, values: &[i32]) -> usize {
    for &value in values {
        let mut rest = zigzag(value);
        while rest >= 0x80 {
            out[at] = rest as u8 | 0x80;
            at += 1;
            rest >>= 7;
        }
        out[at] = rest as u8;
        at += 1;
    }
    at
}

/// Reads `count` values from the head of `bytes` and returns the rest; `None` if they end early or overflow 32 bits.
pub(super) fn read<'a>(mut bytes: &'a [u8], count: usize, out: &mut Vec<i32>) -> Option<&'a [u8]> {
    out.reserve(count);
    let end = out.len() + count;
    while out.len() < end {
        // The common case, eight one-byte values, without a branch a value.
        if let Some((head, tail)) = bytes.split_first_chunk::<8>()
            && end - out.len() >= 8
            && u64::from_le_bytes(*head) & 0x8080_8080_8080_8080 == 0
        {
            out.extend(head.iter().map(|&byte| unzigzag(u32::from(byte))));
            bytes = tail;
            continue;
        }
        let (value, tail) = read_one(bytes)?;
        out.push(unzigzag(value));
        bytes = tail;
    }
    Some(bytes)
}

fn read_one(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let mut value = 0u32;
    for (n, &byte) in bytes.iter().take(MAX_LEN).enumerate() {
        // The fifth byte has room for the top four bits only.
        if n == MAX_LEN - 1 && byte > 0x0F {
            return None;
        }
        value |= u32::from(byte & 0x7F) << (7 * n);
        if byte < 0x80 {
            return Some((value, &bytes[n + 1..]));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bytes(values: &[i32]) -> Vec<u8> {
        let mut out = vec![0; values.len() * MAX_LEN];
        let end = write(&mut out, 0, values);
        out.truncate(end);
        out
    }

    #[test]
    fn known_encodings() {
        assert_eq!(bytes(&[0, -1, 1, -64, 63, 64]), [0, 1, 2, 127, 126, 0x80, 1]);
        assert_eq!(bytes(&[i32::MIN]), [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
        assert_eq!(bytes(&[i32::MAX]), [0xFE, 0xFF, 0xFF, 0xFF, 0x0F]);
    }

    #[test]
    fn overflow_and_early_end_are_refused() {
        assert!(read(&[0xFF, 0xFF, 0xFF, 0xFF, 0x10], 1, &mut Vec::new()).is_none());
        assert!(read(&[0x80; 6], 1, &mut Vec::new()).is_none());
        assert!(read(&[0x80], 1, &mut Vec::new()).is_none());
        assert!(read(&[1, 2], 3, &mut Vec::new()).is_none());
    }

    proptest! {
        #[test]
        fn round_trip(values in prop::collection::vec(prop_oneof![-70..70i32, any::<i32>()], 0..60)) {
            let encoded = bytes(&values);
            let mut out = Vec::new();
            let rest = read(&encoded, values.len(), &mut out).unwrap();
            prop_assert!(rest.is_empty());
            prop_assert_eq!(out, values);
        }
    }
}
