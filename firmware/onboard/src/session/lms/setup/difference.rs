//! In which bytes the block that a device holds differs from the one that it was sent.

use std::fmt;

use biplane_wire::lms::Config;

/// Bytes that are named; more are counted only.
const NAMED: usize = 4;

/// A byte that is not as it was sent.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
struct Byte {
    offset: u8,
    held: u8,
    sent: u8,
}

/// What differs between the configuration that a device holds and the one that was written to it.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct BlockDifference {
    first: [Byte; NAMED],
    count: u8,
    held_bytes: u8,
    sent_bytes: u8,
}

impl BlockDifference {
    /// Compares the blocks byte for byte; a block has [`Config::MAX_BYTES`] at most.
    #[must_use]
    pub fn between(held: &Config, sent: &Config) -> Self {
        let (held, sent) = (held.as_bytes(), sent.as_bytes());
        let mut difference =
            Self { held_bytes: held.len() as u8, sent_bytes: sent.len() as u8, ..Self::default() };
        for (offset, (&held, &sent)) in held.iter().zip(sent).enumerate() {
            if held != sent {
                if let Some(place) = difference.first.get_mut(usize::from(difference.count)) {
                    *place = Byte { offset: offset as u8, held, sent };
                }
                difference.count += 1;
            }
        }
        difference
    }
}

impl fmt::Display for BlockDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut gap = "";
        if self.held_bytes != self.sent_bytes {
            write!(f, "{} bytes instead of {}", self.held_bytes, self.sent_bytes)?;
            gap = ", ";
        }
        for byte in self.first.iter().take(usize::from(self.count)) {
            write!(f, "{gap}byte {} {:02X}h instead of {:02X}h", byte.offset, byte.held, byte.sent)?;
            gap = ", ";
        }
        match usize::from(self.count).saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_that_differ_are_named_and_the_rest_counted() {
        let sent = Config::from_bytes(&[0; 8]).unwrap();
        let reported =
            |held: &[u8]| BlockDifference::between(&Config::from_bytes(held).unwrap(), &sent).to_string();
        assert_eq!(
            reported(&[0, 0, 7, 0, 0, 0, 0, 0x1F]),
            "byte 2 07h instead of 00h, byte 7 1Fh instead of 00h"
        );
        assert_eq!(reported(&[0, 0, 7]), "3 bytes instead of 8, byte 2 07h instead of 00h");
        assert!(reported(&[1; 8]).ends_with("byte 3 01h instead of 00h and 4 more"));
    }
}
