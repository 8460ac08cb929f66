//! How replies are found in a stream: they end with an empty line, and begin with a request.

use super::block::{Block, Body, status};
use super::command::{MAX_REQUEST_BYTES, Request, is_printable};
use crate::framing;
use crate::framing::{Framing, Measure};

/// Longest reply that is taken. Three echoes with intensity of 1081 steps are some 23 KB.
pub const MAX_BLOCK_BYTES: usize = 1 << 15;
/// A status with its sum.
const STATUS_BYTES: usize = 3;

/// Replies of a device.
#[derive(Clone, Copy, Debug)]
pub enum ScipFraming {}

/// Deframer for the client's end of a line. It is as large as the longest reply.
pub type Deframer = framing::Deframer<ScipFraming, MAX_BLOCK_BYTES>;

impl Framing for ScipFraming {
    const START: u8 = b'M';
    const MAX_FRAME: usize = MAX_BLOCK_BYTES;

    fn is_start(byte: u8) -> bool {
        b"MNGHVPIBQRSTC".contains(&byte)
    }

    fn measure(head: &[u8]) -> Measure {
        let reach = head.len().min(MAX_REQUEST_BYTES + 1);
        let Some(end) = head[..reach].iter().position(|&byte| byte == b'\n') else {
            let is_possible = head.len() <= MAX_REQUEST_BYTES && Request::may_begin(head);
            return if is_possible { Measure::Unknown } else { Measure::Noise };
        };
        let Ok(request) = Request::parse(&head[..end]) else { return Measure::Noise };
        let offset = end + 1;
        let rest = &head[offset..];
        let Some(end) = rest.iter().take(STATUS_BYTES + 1).position(|&byte| byte == b'\n') else {
            let is_possible = rest.len() <= STATUS_BYTES && rest.iter().all(|&byte| is_printable(byte));
            return if is_possible { Measure::Unknown } else { Measure::BadLength };
        };
        if !rest[..end].iter().all(|&byte| is_printable(byte)) {
            return Measure::BadLength;
        }
        match status(&rest[..end], offset) {
            Ok(status) => measure_lines(Body::of(request.command, status), head, offset + end + 1),
            Err(_) => Measure::BadLength,
        }
    }

    fn is_intact(frame: &[u8]) -> bool {
        Block::parse(frame).is_ok()
    }
}

/// Looks for the empty line.
fn measure_lines(body: Body, head: &[u8], begin: usize) -> Measure {
    let longest = body.max_line_bytes();
    let mut length = 0;
    for (place, &byte) in head.iter().enumerate().skip(begin) {
        match byte {
            b'\n' if length == 0 => return Measure::Frame(place + 1),
            b'\n' => length = 0,
            byte if length < longest && is_printable(byte) => length += 1,
            _ => return Measure::BadLength,
        }
    }
    if head.len() < MAX_BLOCK_BYTES { Measure::Unknown } else { Measure::BadLength }
}
