//! A whole reply as a view: the request again, a status, lines of values, an empty line.

use super::command::{Command, Delivery, Request, TimeStep};
use super::lines::{CLOCK_CHARACTERS, KeyValue, LINE_CHARACTERS, MAX_KEY_LINE_BYTES};
use super::numbers::{decode, sum};
use crate::WireError;
use crate::cursor::Writer;

/// How a device has taken a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// Two characters with a sum.
    Code([u8; 2]),
    /// One character without: the device is in SCIP 1.1.
    Scip1(u8),
}

impl Status {
    /// Accepted.
    pub const OK: Self = Self::Code(*b"00");
    /// A scan of a stream.
    pub const STREAMED: Self = Self::Code(*b"99");

    /// Whether the device goes on after it has verified an error, or stops to do so (21 to 49, 98).
    #[must_use]
    pub fn is_verifying(self) -> bool {
        matches!(self.number(), Some(21..=49 | 98))
    }

    /// Whether the device says that it is defective (50 to 97).
    #[must_use]
    pub fn is_defect(self) -> bool {
        matches!(self.number(), Some(50..=97))
    }

    fn number(self) -> Option<u32> {
        let Self::Code(code) = self else { return None };
        core::str::from_utf8(&code).ok()?.parse().ok()
    }
}

/// What lines may follow a status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Body {
    /// None.
    Empty,
    /// Keys with their values.
    Keys,
    /// A clock.
    Clock,
    /// A clock and numbers.
    Scan,
}

impl Body {
    pub(crate) fn of(command: Command, status: Status) -> Self {
        match (command, status) {
            (Command::Version | Command::Parameters | Command::Information, Status::Code(_)) => Self::Keys,
            (Command::Time(TimeStep::Read), Status::OK) => Self::Clock,
            (Command::Scans(request), status) => match request.delivery {
                Delivery::Once if status == Status::OK => Self::Scan,
                Delivery::Stream { .. } if status == Status::STREAMED => Self::Scan,
                _ => Self::Empty,
            },
            _ => Self::Empty,
        }
    }

    /// Longest line, without its line feed.
    pub(crate) fn max_line_bytes(self) -> usize {
        match self {
            Self::Empty => 0,
            Self::Keys => MAX_KEY_LINE_BYTES,
            Self::Clock => CLOCK_CHARACTERS + 1,
            Self::Scan => LINE_CHARACTERS + 1,
        }
    }
}

/// One reply, its sums checked; those of keys with values are checked line by line when they are read,
/// because devices are known to send wrong ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block<'a> {
    /// The request that is answered.
    pub request: Request<'a>,
    /// How it was taken.
    pub status: Status,
    /// Lines of values with their sums and line feeds.
    pub lines: &'a [u8],
}

/// The line at `offset` without its line feed.
fn line(bytes: &[u8], offset: usize) -> Result<&[u8], WireError> {
    let rest = bytes.get(offset..).unwrap_or_default();
    let cut = WireError::TooShort { needed: bytes.len() + 1, found: bytes.len() };
    let end = rest.iter().position(|&byte| byte == b'\n').ok_or(cut)?;
    Ok(&rest[..end])
}

impl<'a> Block<'a> {
    /// Checks exactly one reply.
    ///
    /// # Errors
    /// It is cut or goes on, the request is not known, a sum is wrong, or lines have the wrong length.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let echo = line(bytes, 0)?;
        let request = Request::parse(echo)?;
        let offset = echo.len() + 1;
        let text = line(bytes, offset)?;
        let status = status(text, offset)?;
        let begin = offset + text.len() + 1;
        let body = Body::of(request.command, status);
        let mut at = begin;
        let mut place = 0;
        loop {
            let text = line(bytes, at)?;
            if text.is_empty() {
                break;
            }
            let is_last = bytes.get(at + text.len() + 1) == Some(&b'\n');
            check_line(body, text, at, place, is_last)?;
            at += text.len() + 1;
            place += 1;
        }
        if at + 1 < bytes.len() {
            return Err(WireError::TooLong { expected: at + 1, found: bytes.len() });
        }
        Ok(Self { request, status, lines: &bytes[begin..at] })
    }

    /// Keys with their values; those whose sum is wrong are left out.
    pub fn values(&self) -> impl Iterator<Item = KeyValue<'a>> + use<'a> {
        self.lines.split(|&byte| byte == b'\n').filter_map(KeyValue::parse)
    }

    /// The value of a key.
    #[must_use]
    pub fn value(&self, key: &[u8]) -> Option<&'a [u8]> {
        self.values().find(|line| line.key == key).map(|line| line.value)
    }

    /// The clock that a scan or a reply to `TM1` states, in ms.
    #[must_use]
    pub fn clock_ms(&self) -> Option<u32> {
        match Body::of(self.request.command, self.status) {
            Body::Clock | Body::Scan => decode(self.lines.get(..CLOCK_CHARACTERS)?),
            Body::Empty | Body::Keys => None,
        }
    }

    /// Bytes of the whole reply.
    #[must_use]
    pub fn encoded_len(&self) -> usize {
        Writer::measure(|writer| self.write(writer))
    }

    /// Writes the whole reply and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        let mut writer = Writer::new(out);
        self.write(&mut writer);
        writer.finish().map(|written| written.len())
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.request.write(writer);
        match self.status {
            Status::Code(code) => {
                writer.bytes(&code);
                writer.u8(sum(&code));
            }
            Status::Scip1(code) => writer.u8(code),
        }
        writer.u8(b'\n');
        writer.bytes(self.lines);
        writer.u8(b'\n');
    }
}

pub(crate) fn status(text: &[u8], offset: usize) -> Result<Status, WireError> {
    match *text {
        [code] => Ok(Status::Scip1(code)),
        [a, b, found] if sum(&[a, b]) == found => Ok(Status::Code([a, b])),
        [a, b, found] => Err(wrong_sum(sum(&[a, b]), found, offset + 2)),
        _ => Err(WireError::Capacity { field: "status", limit: 3, found: text.len(), offset }),
    }
}

/// Whether a line of a body is as it should be. Only the last line of numbers may be short: what follows a
/// line feed that was lost is no part of this reply.
fn check_line(body: Body, text: &[u8], offset: usize, place: usize, is_last: bool) -> Result<(), WireError> {
    let wrong_length = |limit| WireError::Capacity { field: "line", limit, found: text.len(), offset };
    let is_clock = place == 0;
    let expected = match body {
        Body::Scan if is_clock => CLOCK_CHARACTERS + 1,
        body => body.max_line_bytes(),
    };
    let may_be_short = body == Body::Keys || (body == Body::Scan && !is_clock && is_last);
    let is_too_many = body == Body::Empty || (body == Body::Clock && !is_clock);
    if is_too_many || text.len() > expected || (text.len() < expected && !may_be_short) {
        return Err(wrong_length(if is_too_many { 0 } else { expected }));
    }
    if body == Body::Keys {
        // A request is the begin of the next reply, behind a line feed that was lost.
        let is_request = Request::parse(text).is_ok();
        return if is_request { Err(wrong_length(0)) } else { Ok(()) };
    }
    let (&found, numbers) = text.split_last().ok_or(wrong_length(expected))?;
    if numbers.is_empty() {
        return Err(wrong_length(expected));
    }
    match sum(numbers) {
        right if right == found => Ok(()),
        right => Err(wrong_sum(right, found, offset + numbers.len())),
    }
}

fn wrong_sum(expected: u8, found: u8, offset: usize) -> WireError {
    WireError::Checksum { expected: u16::from(expected), found: u16::from(found), offset }
}
