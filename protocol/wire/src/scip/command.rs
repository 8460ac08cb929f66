//! Requests to a device: two letters, numbers of fixed width, and a text of the client's own behind `;`.

use crate::WireError;
use crate::cursor::Writer;

/// Longest text that a client may append.
const MAX_TAG_BYTES: usize = 16;
/// Longest request without such a text: that of a stream of scans.
const MAX_COMMAND_BYTES: usize = 15;
/// Longest request, its `;` included.
pub(crate) const MAX_REQUEST_BYTES: usize = MAX_COMMAND_BYTES + 1 + MAX_TAG_BYTES;
/// Ends a request.
const END: u8 = b'\n';

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Command {
    /// `VV`: vendor, product, firmware, protocol, serial number.
    Version,
    /// `PP`: geometry, reach, rate.
    Parameters,
    /// `II`: state.
    Information,
    /// `BM`: switch the laser on.
    LaserOn,
    /// `QT`: end a stream, switch the laser off.
    Quit,
    /// `RS`: reset rate, motor and clock.
    Reset,
    /// `RT`: the same, but rate and motor stay.
    PartialReset,
    /// `RB`: reboot; twice within a second.
    Reboot,
    /// `SCIP2.0`: leave SCIP 1.1.
    Scip2,
    /// `TM0`, `TM1`, `TM2`: the clock.
    Time(TimeStep),
    /// `SS`: rate of the serial line, Bd, at most six digits.
    Baud(u32),
    /// `CR`: slow the motor; 0 to 99.
    Motor(u8),
    /// `HS`: high sensitivity, 0 or 1.
    Sensitivity(u8),
    /// `GD`, `MD` and the like: scans.
    Scans(ScanRequest),
}

/// Steps of reading the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TimeStep {
    /// Enter the mode in which it is read; nothing is measured in it.
    Enter,
    /// Read it.
    Read,
    /// Leave the mode.
    Leave,
}

/// How scans are delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Delivery {
    /// The latest one, once.
    Once,
    /// A number of them, or until told to stop.
    Stream {
        /// So many are left out between two; 0 to 9.
        skip: u8,
        /// Scans that are still to come; 0 for ever.
        count: u8,
    },
}

/// Which part of which scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScanRequest {
    /// Once or as a stream.
    pub delivery: Delivery,
    /// Whether all echoes of a step are sent.
    pub all_echoes: bool,
    /// Whether each range comes with its intensity.
    pub with_intensity: bool,
    /// First step; 0 to 9999.
    pub first_step: u16,
    /// Last step.
    pub last_step: u16,
    /// So many steps are joined to one value, the nearest of them; 0 counts as 1, at most 99.
    pub cluster: u8,
}

impl ScanRequest {
    /// Steps of one value.
    #[must_use]
    pub fn steps_per_value(&self) -> u16 {
        u16::from(self.cluster.max(1))
    }

    /// Values of a scan; 0 when the last step is in front of the first.
    #[must_use]
    pub fn values(&self) -> usize {
        let steps = (u32::from(self.last_step) + 1).saturating_sub(u32::from(self.first_step));
        steps.div_ceil(u32::from(self.steps_per_value())) as usize
    }

    fn letters(&self) -> [u8; 2] {
        let first = match (self.delivery, self.all_echoes) {
            (Delivery::Once, false) => b'G',
            (Delivery::Once, true) => b'H',
            (Delivery::Stream { .. }, false) => b'M',
            (Delivery::Stream { .. }, true) => b'N',
        };
        [first, if self.with_intensity { b'E' } else { b'D' }]
    }

    fn of_text(text: &[u8]) -> Option<Self> {
        let [kind, values, rest @ ..] = text else { return None };
        let (range, rest) = rest.split_at_checked(10)?;
        let digits = |from: usize, to: usize| range.get(from..to).and_then(number);
        let delivery = match (kind, rest) {
            (b'G' | b'H', []) => Delivery::Once,
            (b'M' | b'N', [skip, count @ ..]) if count.len() == 2 => {
                Delivery::Stream { skip: number(&[*skip])? as u8, count: number(count)? as u8 }
            }
            _ => return None,
        };
        Some(Self {
            delivery,
            all_echoes: matches!(kind, b'H' | b'N'),
            with_intensity: match values {
                b'D' => false,
                b'E' => true,
                _ => return None,
            },
            first_step: digits(0, 4)? as u16,
            last_step: digits(4, 8)? as u16,
            cluster: digits(8, 10)? as u8,
        })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.bytes(&self.letters());
        decimal::<4>(writer, u32::from(self.first_step));
        decimal::<4>(writer, u32::from(self.last_step));
        decimal::<2>(writer, u32::from(self.cluster));
        if let Delivery::Stream { skip, count } = self.delivery {
            decimal::<1>(writer, u32::from(skip));
            decimal::<2>(writer, u32::from(count));
        }
    }
}

/// A request, or its echo in a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Request<'a> {
    /// What is asked.
    pub command: Command,
    /// The client's own text, which the reply repeats; `None` without the `;`.
    pub tag: Option<&'a [u8]>,
}

impl From<Command> for Request<'_> {
    fn from(command: Command) -> Self {
        Self { command, tag: None }
    }
}

/// Requests without numbers.
const PLAIN: [(&[u8], Command); 12] = [
    (b"VV", Command::Version),
    (b"PP", Command::Parameters),
    (b"II", Command::Information),
    (b"BM", Command::LaserOn),
    (b"QT", Command::Quit),
    (b"RS", Command::Reset),
    (b"RT", Command::PartialReset),
    (b"RB", Command::Reboot),
    (b"SCIP2.0", Command::Scip2),
    (b"TM0", Command::Time(TimeStep::Enter)),
    (b"TM1", Command::Time(TimeStep::Read)),
    (b"TM2", Command::Time(TimeStep::Leave)),
];

impl<'a> Request<'a> {
    /// Reads a line without its end.
    ///
    /// # Errors
    /// It is no request, or one that is not known here.
    pub fn parse(line: &'a [u8]) -> Result<Self, WireError> {
        let end = line.iter().position(|&byte| byte == b';').unwrap_or(line.len());
        let (text, behind) = line.split_at(end);
        let tag = behind.get(1..);
        let first = u32::from(text.first().copied().unwrap_or_default());
        let command = command(text).ok_or(WireError::Value { field: "request", found: first, offset: 0 })?;
        let tag_bytes = tag.unwrap_or_default();
        if tag_bytes.len() > MAX_TAG_BYTES {
            let (limit, found, offset) = (MAX_TAG_BYTES, tag_bytes.len(), end + 1);
            return Err(WireError::Capacity { field: "text behind a request", limit, found, offset });
        }
        match tag_bytes.iter().position(|&byte| !is_of_tag(byte)) {
            Some(place) => Err(WireError::Value {
                field: "text behind a request",
                found: u32::from(tag_bytes[place]),
                offset: end + 1 + place,
            }),
            None => Ok(Self { command, tag }),
        }
    }

    /// Whether a line that is not yet whole may become a request.
    pub(crate) fn may_begin(start: &[u8]) -> bool {
        let letters = |known: &[u8]| start.iter().zip(known).take(2).all(|(found, known)| found == known);
        let is_known = PLAIN.iter().any(|(text, _)| letters(text))
            || NUMBERED.iter().any(|text| letters(*text))
            || (start.first().is_some_and(|byte| b"GHMN".contains(byte))
                && start.get(1).is_none_or(|byte| b"DE".contains(byte)));
        is_known && start.len() <= MAX_REQUEST_BYTES && start.iter().all(|&byte| is_printable(byte))
    }

    /// Writes the request with its end, and returns its length.
    ///
    /// # Errors
    /// `out` is too small.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, WireError> {
        let mut writer = Writer::new(out);
        self.write(&mut writer);
        writer.finish().map(|written| written.len())
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) {
        match self.command {
            Command::Baud(baud) => {
                writer.bytes(b"SS");
                decimal::<6>(writer, baud);
            }
            Command::Motor(speed) => {
                writer.bytes(b"CR");
                decimal::<2>(writer, u32::from(speed));
            }
            Command::Sensitivity(level) => {
                writer.bytes(b"HS");
                decimal::<1>(writer, u32::from(level));
            }
            Command::Scans(request) => request.write(writer),
            plain => {
                let text = PLAIN.iter().find(|(_, command)| *command == plain);
                writer.bytes(text.map_or(&[][..], |(text, _)| text));
            }
        }
        if let Some(tag) = self.tag {
            writer.u8(b';');
            writer.bytes(tag);
        }
        writer.u8(END);
    }
}

/// Letters of requests with numbers that are no scans.
const NUMBERED: [&[u8; 2]; 3] = [b"SS", b"CR", b"HS"];

fn command(text: &[u8]) -> Option<Command> {
    if let Some((_, command)) = PLAIN.iter().find(|(plain, _)| *plain == text) {
        return Some(*command);
    }
    match text {
        [b'S', b'S', digits @ ..] if digits.len() == 6 => number(digits).map(Command::Baud),
        [b'C', b'R', digits @ ..] if digits.len() == 2 => {
            number(digits).map(|speed| Command::Motor(speed as u8))
        }
        [b'H', b'S', digits @ ..] if digits.len() == 1 => {
            number(digits).map(|level| Command::Sensitivity(level as u8))
        }
        _ => ScanRequest::of_text(text).map(Command::Scans),
    }
}

/// At most six digits.
fn number(digits: &[u8]) -> Option<u32> {
    digits.iter().try_fold(0, |number, &digit| Some(number * 10 + char::from(digit).to_digit(10)?))
}

/// The lowest digits of a number.
fn decimal<const N: usize>(writer: &mut Writer<'_>, number: u32) {
    let mut rest = number;
    let mut digits = [b'0'; N];
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    writer.bytes(&digits);
}

fn is_of_tag(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b" ._+@".contains(&byte)
}

pub(crate) fn is_printable(byte: u8) -> bool {
    matches!(byte, b' '..=b'~')
}
