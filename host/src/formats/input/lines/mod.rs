//! Clouds as text, line by line: a point a line ([`xyz`], with the counts of PTS), or scans with a header
//! each ([`ptx`]).

pub(crate) mod pts;
pub(crate) mod ptx;
pub(crate) mod xyz;

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// No line of a cloud is longer, bytes.
const MAX_LINE: u64 = 1 << 16;
/// What editors of some systems put at the start of a text.
const BYTE_ORDER_MARK: &str = "\u{feff}";

/// The lines of a text, one after the other.
#[derive(Debug)]
pub(crate) struct Lines<R> {
    text: R,
    bytes: Vec<u8>,
    /// Number of the line that was read last, from 1; at the end, of the one that is not there.
    pub number: usize,
}

impl<R: BufRead> Lines<R> {
    /// From the text's start.
    pub(crate) fn of(text: R) -> Self {
        Self { text, bytes: Vec::new(), number: 0 }
    }

    /// Number of the next line and the line without blanks around it, `None` at the end.
    pub(crate) fn next_line(&mut self) -> io::Result<Option<(usize, Cow<'_, str>)>> {
        self.bytes.clear();
        self.number += 1;
        if self.text.by_ref().take(MAX_LINE).read_until(b'\n', &mut self.bytes)? == 0 {
            return Ok(None);
        }
        let line = self.bytes.strip_prefix(BYTE_ORDER_MARK.as_bytes()).unwrap_or(&self.bytes);
        Ok(Some((self.number, String::from_utf8_lossy(line.trim_ascii()))))
    }
}
