//! Device sessions: state machines that talk to one device each, without any I/O.
//!
//! A session has two doors. [`Session::handle`] takes one input with the time at which it happened; [`Session::poll`] is then
//! asked until it answers [`Output::WaitUntil`]: nothing more before this time or the next bytes. Whoever drives a
//! session (serial port, pseudo-terminal, capture, test) writes the bytes, changes the rate and calls again. Times are
//! nanoseconds on any one line that does not step. Sources: SICK telegram listing 8007954, Pioneer manuals.

pub mod base;
mod event;
pub mod laser;
#[cfg(test)]
pub(crate) mod noise;
pub mod retry;
#[cfg(test)]
mod script;
mod silence;

use biplane_wire::WireError;
use biplane_wire::deframe::{Deframer, Framing};
use biplane_wire::lms::Text;
pub use event::{Event, Step};

/// The longest request is the LMS configuration (41 bytes).
const REQUEST_CAPACITY: usize = 64;

/// Bytes of one request to a device.
pub type RequestBytes = heapless::Vec<u8, REQUEST_CAPACITY>;

/// A name or a version that a device has told, printable ASCII only.
pub type ShortText = heapless::String<32>;

pub(crate) fn printable(text: Text<'_>) -> ShortText {
    let mut kept = ShortText::new();
    for &byte in text.trimmed().iter().take(kept.capacity()) {
        let letter = if matches!(byte, b' '..=b'~') { char::from(byte) } else { '.' };
        if kept.push(letter).is_err() {
            break;
        }
    }
    kept
}

/// What happens to a session.
#[derive(Copy, Clone, Debug)]
pub enum Input<'a> {
    /// A read returned these bytes; at most [`MAX_INPUT_BYTES`] at once.
    Bytes(&'a [u8]),
    /// Nothing came; time has passed.
    Time,
    /// The port does not run at this rate, bits per second, which was asked for with [`Output::SetBaud`].
    RateRefused(u32),
    /// The port was gone and is there again; nothing was heard meanwhile.
    PortBack,
    /// The device shall be left idle; [`Session::is_done`] tells when it is.
    Stop,
}

/// Longest run of bytes that a session takes in one input.
pub const MAX_INPUT_BYTES: usize = 256;

/// Outputs that may wait to be polled.
const OUTPUT_CAPACITY: usize = 24;
/// With more outputs waiting than this, a session reads no further in its bytes: one telegram leads to 8 at most, the time that
/// passes to as many.
const FULL_OUTPUTS: usize = OUTPUT_CAPACITY - 16;

/// What a session wants done.
#[derive(Clone, PartialEq, Debug)]
#[allow(clippy::large_enum_variant)] // No heap in the acquisition path: a scan is handed on by value.
pub enum Output {
    /// Send these bytes to the device.
    Write(RequestBytes),
    /// Change the port's rate, bits per second. What the port has received by then still comes.
    SetBaud(u32),
    /// A scan has arrived.
    Scan(laser::ScanReading),
    /// An odometry report has arrived.
    Odometry(base::OdometryReading),
    /// Something worth saying happened.
    Event(Event),
    /// Nothing more until this time (nanoseconds; `i64::MAX` = until bytes come).
    WaitUntil(i64),
}

/// A device session.
pub trait Session {
    /// Takes one input at its time. Drain [`Session::poll`] afterwards.
    fn handle(&mut self, now_ns: i64, input: Input<'_>);

    /// The next thing to do.
    fn poll(&mut self) -> Output;

    /// Whether the session has nothing left to say: stopped, or its one task is done.
    fn is_done(&self) -> bool;

    /// The rate of the line now, bits per second.
    fn baud(&self) -> u32;

    /// The account of all bytes that came.
    fn counts(&self) -> biplane_wire::Counts;

    /// Outputs that were lost because nobody polled in time; 0 when every input is followed by [`Session::poll`] as it should.
    fn overflowed(&self) -> u64;
}

/// Outputs that wait to be polled. Bounded: however many telegrams end in one input, the rest of it is read when the first have been
/// polled. An overflow is counted, not hidden.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outputs {
    queue: heapless::Deque<Output, OUTPUT_CAPACITY>,
    overflowed: u64,
}

impl Outputs {
    pub(crate) fn push(&mut self, output: Output) {
        if self.queue.push_back(output).is_err() {
            self.overflowed += 1;
        }
    }

    pub(crate) fn say(&mut self, event: Event) {
        self.push(Output::Event(event));
    }

    /// A request to the device, as `emit` puts it into the bytes that it is given.
    pub(crate) fn write(&mut self, emit: impl FnOnce(&mut [u8]) -> Result<usize, WireError>) {
        let mut bytes = [0; REQUEST_CAPACITY];
        if let Ok(length) = emit(&mut bytes)
            && let Ok(bytes) = RequestBytes::from_slice(&bytes[..length])
        {
            self.push(Output::Write(bytes));
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Output> {
        self.queue.pop_front()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Whether there is room for what one more telegram leads to.
    pub(crate) fn has_room(&self) -> bool {
        self.queue.len() <= FULL_OUTPUTS
    }

    pub(crate) fn overflowed(&self) -> u64 {
        self.overflowed
    }
}

/// Bytes of one input on their way to the deframer, as it has room for them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Intake {
    bytes: heapless::Vec<u8, MAX_INPUT_BYTES>,
    taken: usize,
}

impl Intake {
    /// Takes an input. The one before has been read to its end, since its outputs were polled.
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        self.bytes.clear();
        self.taken = 0;
        let longest = bytes.len().min(MAX_INPUT_BYTES);
        let _ = self.bytes.extend_from_slice(bytes.get(..longest).unwrap_or_default());
    }

    /// Hands on what the deframer takes; false when nothing is left, or it takes nothing.
    pub(crate) fn hand_on<F: Framing, const N: usize>(&mut self, deframer: &mut Deframer<F, N>) -> bool {
        let count = deframer.push(self.bytes.get(self.taken..).unwrap_or_default());
        self.taken += count;
        count > 0
    }
}
