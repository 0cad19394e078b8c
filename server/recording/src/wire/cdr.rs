//! Common Data Representation, version 1, as ROS 2 writes it: four bytes that say which byte order follows, then
//! values aligned to their own size, counted from the end of those four.

use super::Malformed;

const ENCAPSULATION_BYTES: usize = 4;

#[derive(Clone, Copy)]
enum ByteOrder {
    Big,
    Little,
}

/// Reads values one after another; each read names the field that is cut short.
pub(super) struct CdrReader<'a> {
    body: &'a [u8],
    position: usize,
    order: ByteOrder,
}

impl<'a> CdrReader<'a> {
    pub fn new(data: &'a [u8]) -> Result<Self, Malformed> {
        let Some((encapsulation, body)) = data.split_first_chunk::<ENCAPSULATION_BYTES>() else {
            return Err(Malformed::new("encapsulation", format!("{} bytes, not 4", data.len())));
        };
        let order = match encapsulation {
            [0, 0, ..] => ByteOrder::Big,
            [0, 1, ..] => ByteOrder::Little,
            [high, low, ..] => {
                let problem = format!("kind {high:02x}{low:02x} is not read; plain cdr, 0000 and 0001, is");
                return Err(Malformed::new("encapsulation", problem));
            }
        };
        Ok(Self { body, position: 0, order })
    }

    pub fn u8(&mut self, field: &str) -> Result<u8, Malformed> {
        Ok(self.take(1, field)?[0])
    }

    pub fn u32(&mut self, field: &str) -> Result<u32, Malformed> {
        let bytes = self.aligned(field)?;
        Ok(match self.order {
            ByteOrder::Big => u32::from_be_bytes(bytes),
            ByteOrder::Little => u32::from_le_bytes(bytes),
        })
    }

    pub fn i32(&mut self, field: &str) -> Result<i32, Malformed> {
        Ok(self.u32(field)?.cast_signed())
    }

    pub fn f64(&mut self, field: &str) -> Result<f64, Malformed> {
        let bytes = self.aligned(field)?;
        Ok(match self.order {
            ByteOrder::Big => f64::from_be_bytes(bytes),
            ByteOrder::Little => f64::from_le_bytes(bytes),
        })
    }

    pub fn f64_array<const N: usize>(&mut self, field: &str) -> Result<[f64; N], Malformed> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    pub fn f64_sequence(&mut self, field: &str) -> Result<Vec<f64>, Malformed> {
        let count = self.length(field, size_of::<f64>())?;
        (0..count).map(|_| self.f64(field)).collect()
    }

    /// A sequence of octets.
    pub fn bytes(&mut self, field: &str) -> Result<&'a [u8], Malformed> {
        let length = self.length(field, 1)?;
        self.take(length, field)
    }

    /// A string; its terminating zero counts in its length.
    pub fn string(&mut self, field: &str) -> Result<String, Malformed> {
        let bytes = self.bytes(field)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        let text = std::str::from_utf8(text).map_err(|error| Malformed::new(field, error))?;
        Ok(text.to_owned())
    }

    /// The length of a sequence, refused before anything is allocated where the message cannot hold it.
    fn length(&mut self, field: &str, item_bytes: usize) -> Result<usize, Malformed> {
        let count = self.u32(field)? as usize;
        let left = self.body.len() - self.position;
        match count.checked_mul(item_bytes) {
            Some(bytes) if bytes <= left => Ok(count),
            _ => Err(Malformed::new(field, format!("length {count} in a message with {left} bytes left"))),
        }
    }

    fn aligned<const N: usize>(&mut self, field: &str) -> Result<[u8; N], Malformed> {
        let padding = self.position.next_multiple_of(N) - self.position;
        self.take(padding, field)?;
        let bytes = self.take(N, field)?;
        Ok(*bytes.first_chunk().expect("exactly N bytes were taken"))
    }

    fn take(&mut self, length: usize, field: &str) -> Result<&'a [u8], Malformed> {
        let left = self.body.get(self.position..).unwrap_or_default();
        let Some(taken) = left.get(..length) else {
            return Err(Malformed::new(
                field,
                format!("the message ends {} bytes early", length - left.len()),
            ));
        };
        self.position += length;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::super::ros2;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_length_beyond_the_message_is_refused_before_allocation() {
        for length in [9_u32, 1 << 20, u32::MAX] {
            let message = [&[0, 1, 0, 0], length.to_le_bytes().as_slice(), &[0; 8]].concat();
            let refused = |problem: Malformed| assert!(problem.problem.contains(&format!("length {length}")));
            refused(CdrReader::new(&message).unwrap().bytes("data").unwrap_err());
            refused(CdrReader::new(&message).unwrap().string("encoding").unwrap_err());
            refused(CdrReader::new(&message).unwrap().f64_sequence("d").unwrap_err());
        }
    }

    #[test]
    fn values_are_aligned_from_the_end_of_the_encapsulation() {
        let mut message = vec![0, 0, 0, 0, 7, 99, 99, 99, 0, 0, 0, 5];
        message.extend(1.5_f64.to_be_bytes());
        let mut reader = CdrReader::new(&message).unwrap();
        assert_eq!((reader.u8("a"), reader.u32("b"), reader.f64("c")), (Ok(7), Ok(5), Ok(1.5)));
        assert!(reader.u8("d").unwrap_err().problem.contains("1 bytes early"));
    }

    #[test]
    fn other_encapsulations_are_named() {
        let problem = CdrReader::new(&[0, 7, 0, 0]).err().unwrap().problem;
        assert!(problem.contains("0007"), "{problem}");
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_message_or_an_error(mut bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            // Most random bytes would fail at the encapsulation.
            if let Some(kind) = bytes.first_chunk_mut::<2>() {
                *kind = [0, kind[1] & 1];
            }
            let _ = (ros2::image(&bytes), ros2::compressed_image(&bytes), ros2::camera_info(&bytes));
        }

        #[test]
        fn strings_and_sequences_never_read_past_the_message(
            lengths in prop::collection::vec(any::<u32>(), 1..6), tail in prop::collection::vec(any::<u8>(), 0..64),
        ) {
            let mut bytes = vec![0, 1, 0, 0];
            bytes.extend(lengths.iter().flat_map(|length| (length % 100).to_le_bytes()));
            bytes.extend(tail);
            let mut reader = CdrReader::new(&bytes).unwrap();
            let mut total = 4;
            while let Ok(octets) = reader.bytes("data") {
                total += 4 + octets.len();
            }
            prop_assert!(total <= bytes.len());
        }
    }
}
