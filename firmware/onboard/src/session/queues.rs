//! What waits between a session and whoever drives it: outputs to be polled, bytes to be read on.

use biplane_wire::WireError;
use biplane_wire::framing::{Deframer, Framing};

use crate::session::device_session::{MAX_INPUT_BYTES, Output, REQUEST_CAPACITY, RequestBytes};
use crate::session::event::Event;

/// Outputs that may wait to be polled.
const OUTPUT_CAPACITY: usize = 24;
/// With more outputs waiting than this, a session reads no further in its bytes: one telegram leads to 8 at
/// most, the time that passes to as many.
const FULL_OUTPUTS: usize = OUTPUT_CAPACITY - 16;

/// Outputs that wait to be polled. Bounded: however many telegrams end in one input, the rest of it is read
/// when the first have been polled. An overflow is counted, not hidden.
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
