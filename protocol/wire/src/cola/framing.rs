//! How telegrams of both dialects are found in a stream: a line may change between them.

use super::kind::{KIND_BYTES, Kind};
use crate::framing;
use crate::framing::{Framing, Measure};

/// First byte of every telegram; four of them in CoLa B.
pub(crate) const START: u8 = 0x02;
/// Last byte of a telegram of CoLa A.
pub(crate) const END: u8 = 0x03;
/// Starts and length of CoLa B, in front of the body.
pub(crate) const BODY_OFFSET: usize = 8;
/// Everything of a telegram of CoLa B but its body.
pub(crate) const OVERHEAD: usize = BODY_OFFSET + 1;
/// Longest telegram that is taken. Five echoes of an LMS5xx with remission are some 17 KB in CoLa B and 45 KB
/// in CoLa A.
pub const MAX_TELEGRAM_BYTES: usize = 1 << 16;

/// Telegrams in either direction and either dialect.
#[derive(Clone, Copy, Debug)]
pub enum ColaFraming {}

/// Deframer for either end of a line. It is as large as the longest telegram.
pub type Deframer = framing::Deframer<ColaFraming, MAX_TELEGRAM_BYTES>;

impl Framing for ColaFraming {
    const START: u8 = START;
    const MAX_FRAME: usize = MAX_TELEGRAM_BYTES;

    fn measure(head: &[u8]) -> Measure {
        match *head {
            [_, START, START, START, a, b, c, d, ref body @ ..] => {
                let length = u32::from_be_bytes([a, b, c, d]) as usize;
                match length {
                    KIND_BYTES..=MAX_TELEGRAM_BYTES if body.len() < KIND_BYTES && is_kind(body) => {
                        Measure::Unknown
                    }
                    KIND_BYTES..=MAX_TELEGRAM_BYTES if is_kind(body) => Measure::Frame(length + OVERHEAD),
                    _ => Measure::BadLength,
                }
            }
            [_, ref rest @ ..] if rest.iter().take(3).all(|&byte| byte == START) => Measure::Unknown,
            [_, b's', ref rest @ ..] if is_kind(&head[1..]) => {
                match rest.iter().position(|&byte| byte < b' ') {
                    Some(place) if rest[place] == END => Measure::Frame(place + 3),
                    Some(_) => Measure::BadLength,
                    None if head.len() > MAX_TELEGRAM_BYTES => Measure::BadLength,
                    None => Measure::Unknown,
                }
            }
            _ => Measure::Noise,
        }
    }

    fn is_intact(frame: &[u8]) -> bool {
        match frame {
            [START, START, START, START, _, _, _, _, body @ .., sum] => checksum(body) == *sum,
            [START, .., END] => true,
            _ => false,
        }
    }
}

/// Whether bytes begin as a body does, as far as they go.
fn is_kind(body: &[u8]) -> bool {
    let start = body.get(..KIND_BYTES).unwrap_or(body);
    Kind::ALL.iter().any(|kind| kind.bytes().starts_with(start))
}

/// The sum of a body of CoLa B: all its bytes XORed.
#[must_use]
pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}
