//! Unsigned LEB128 numbers of at most 32 bits: seven bits a byte, low ones first.

use crate::ProtocolError;

/// Appends a number.
pub(crate) fn put(bytes: &mut Vec<u8>, mut number: u32) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Reads `bytes` as numbers to the end, `limit` of them at most; nothing is allocated beyond what the bytes hold.
///
/// # Errors
/// [`ProtocolError::Varint`] for a number that is cut short or longer than 32 bits, [`ProtocolError::TooMany`].
pub(crate) fn read_all(field: &'static str, bytes: &[u8], limit: usize) -> Result<Vec<u32>, ProtocolError> {
    let count = bytes.iter().filter(|&&byte| byte < 0x80).count();
    if count > limit {
        return Err(ProtocolError::TooMany { field, got: count, limit });
    }
    let mut numbers = Vec::with_capacity(count);
    let mut rest = bytes;
    while !rest.is_empty() {
        let (number, length) = read(rest).ok_or(ProtocolError::Varint { field, index: numbers.len() })?;
        numbers.push(number);
        rest = &rest[length..];
    }
    Ok(numbers)
}

/// The first number and its length in bytes.
fn read(bytes: &[u8]) -> Option<(u32, usize)> {
    let mut number = 0_u64;
    for (place, &byte) in bytes.iter().take(5).enumerate() {
        number |= u64::from(byte & 0x7F) << (7 * place);
        if byte < 0x80 {
            return u32::try_from(number).ok().map(|number| (number, place + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_lengths_survive() {
        let numbers = [0, 1, 127, 128, 16_383, 16_384, u32::MAX - 1, u32::MAX];
        let mut bytes = Vec::new();
        numbers.iter().for_each(|&number| put(&mut bytes, number));
        assert_eq!(read_all("ids", &bytes, 8), Ok(numbers.to_vec()));
    }

    #[test]
    fn what_is_cut_short_too_long_or_too_much_is_refused() {
        let varint = |index| ProtocolError::Varint { field: "ids", index };
        assert_eq!(read_all("ids", &[5, 0x80], 8), Err(varint(1)));
        assert_eq!(read_all("ids", &[0xFF, 0xFF, 0xFF, 0xFF, 0x1F], 8), Err(varint(0)));
        assert_eq!(read_all("ids", &[0x80, 0x80, 0x80, 0x80, 0x80, 0], 8), Err(varint(0)));
        let too_many = ProtocolError::TooMany { field: "ids", got: 9, limit: 8 };
        assert_eq!(read_all("ids", &[0; 9], 8), Err(too_many));
    }
}
