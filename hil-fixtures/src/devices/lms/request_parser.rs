//! The ear of a mock laser: bytes from the host to telegrams, the way a small controller does it.
//!
//! A telegram is STX, address, length, body, checksum (SICK telegram listing 3.1). The bytes of one telegram
//! must follow each other closely, else it is dropped (listing: 6 ms). This reader is written apart from
//! `biplane-wire`'s deframer on purpose: the driver and the device that tests it should not share a mistake.

use super::frame::checksum;

/// Longest body that a request can have; a longer length field is taken for noise.
const LONGEST_BODY: usize = 256;

const STX: u8 = 0x02;

/// What the ear made of a byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Parsed {
    /// Nothing whole yet.
    Nothing,
    /// A telegram with a good checksum: address and body (code and data).
    Request {
        /// Address byte: 00 means every device.
        address: u8,
        /// Code byte and data.
        body: Vec<u8>,
    },
    /// A telegram whose checksum is wrong; to be answered with NAK.
    BadChecksum,
}

/// Collects the bytes of one telegram at a time.
#[derive(Debug)]
pub struct RequestParser {
    frame: Vec<u8>,
    last_ns: i64,
    /// Bytes further apart than this do not belong together.
    gap_ns: i64,
    /// Bytes that belonged to no telegram.
    pub dropped_bytes: u64,
}

impl RequestParser {
    /// An ear that gives a telegram up when two of its bytes are further apart than `gap_ns`.
    #[must_use]
    pub fn new(gap_ns: i64) -> Self {
        Self { frame: Vec::with_capacity(LONGEST_BODY + 6), last_ns: i64::MIN, gap_ns, dropped_bytes: 0 }
    }

    /// Gives up what has been heard so far.
    pub fn forget(&mut self) {
        self.dropped_bytes += self.frame.len() as u64;
        self.frame.clear();
    }

    /// Takes one byte that arrived at `now_ns`.
    pub fn hear(&mut self, now_ns: i64, byte: u8) -> Parsed {
        if now_ns.saturating_sub(self.last_ns) > self.gap_ns {
            self.forget();
        }
        self.last_ns = now_ns;
        if self.frame.is_empty() && byte != STX {
            self.dropped_bytes += 1;
            return Parsed::Nothing;
        }
        self.frame.push(byte);
        self.judge()
    }

    fn judge(&mut self) -> Parsed {
        let [_, address, low, high, ..] = self.frame[..] else { return Parsed::Nothing };
        let length = usize::from(u16::from_le_bytes([low, high]));
        if length == 0 || length > LONGEST_BODY || address >= 0x80 {
            self.forget();
            return Parsed::Nothing;
        }
        if self.frame.len() < length + 6 {
            return Parsed::Nothing;
        }
        let (covered, sum) = self.frame.split_at(length + 4);
        let good = checksum(covered).to_le_bytes() == sum;
        let body = covered[4..].to_vec();
        if good {
            self.frame.clear();
            Parsed::Request { address, body }
        } else {
            self.forget();
            Parsed::BadChecksum
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: [u8; 7] = [0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12];

    fn hear(parser: &mut RequestParser, bytes: &[u8], step_ns: i64) -> Vec<Parsed> {
        let received = bytes.iter().enumerate().map(|(i, &byte)| parser.hear(i as i64 * step_ns, byte));
        received.filter(|received| *received != Parsed::Nothing).collect()
    }

    #[test]
    fn a_good_request_is_heard_behind_noise() {
        let mut parser = RequestParser::new(6_000_000);
        let mut bytes = vec![0xFF, 0x00, 0x42];
        bytes.extend(STATUS);
        assert_eq!(hear(&mut parser, &bytes, 1_000_000), [Parsed::Request { address: 0, body: vec![0x31] }]);
        assert_eq!(parser.dropped_bytes, 3);
    }

    #[test]
    fn a_wrong_checksum_is_reported_and_the_next_request_is_heard() {
        let mut parser = RequestParser::new(6_000_000);
        let mut bytes = STATUS.to_vec();
        bytes[6] ^= 1;
        bytes.extend(STATUS);
        let received = hear(&mut parser, &bytes, 1_000_000);
        assert_eq!(received, [Parsed::BadChecksum, Parsed::Request { address: 0, body: vec![0x31] }]);
    }

    #[test]
    fn another_lasers_reply_is_no_request() {
        let mut bytes = vec![0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        bytes.extend(STATUS);
        let received = hear(&mut RequestParser::new(6_000_000), &bytes, 1_000_000);
        assert_eq!(received, [Parsed::Request { address: 0, body: vec![0x31] }]);
    }

    #[test]
    fn bytes_too_far_apart_are_no_telegram() {
        assert_eq!(hear(&mut RequestParser::new(6_000_000), &STATUS, 7_000_000), []);
    }
}
