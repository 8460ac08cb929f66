//! When something last came on a laser's line, and how long it may stay out. Times are nanoseconds.

use crate::session::event::Event;
use crate::session::timing::silence;

/// Without a byte for so long, the device is silent: also a slow line pauses for two mirror turns at most,
/// and adapters stall for 0.3 s.
const SILENT_NS: i64 = 900_000_000;
/// With a byte in the last so many nanoseconds the line is called garbled, not silent.
const RECENT_NS: i64 = 500_000_000;
/// Without a telegram for so long, the line is garbled, which is said within a second; at slow rates a little
/// more than the time of one, and two and a half of it without an intact one.
const GARBLED_NS: i64 = 950_000_000;
/// No line of a device that streams pauses for so long, nanoseconds.
const PAUSE_NS: i64 = 250_000_000;

/// The times of one line.
#[derive(Copy, Clone, Debug)]
pub(crate) struct LineTimes {
    /// When the last byte came.
    pub(crate) last_byte_ns: i64,
    /// When the last intact telegram came.
    last_frame_ns: i64,
    /// When the last telegram came that was one, intact or not.
    last_sign_ns: i64,
    /// When bytes came after a pause.
    resumed_ns: i64,
    /// Since when the line is listened to: not while its port was gone.
    received_since_ns: i64,
    /// Telegrams with a wrong checksum so far.
    bad_checksums: u64,
}

impl LineTimes {
    /// A line that is listened to from now on.
    pub(crate) fn new(now_ns: i64) -> Self {
        Self {
            last_byte_ns: now_ns,
            last_frame_ns: now_ns,
            last_sign_ns: now_ns,
            resumed_ns: now_ns,
            received_since_ns: now_ns,
            bad_checksums: 0,
        }
    }

    /// Bytes have come, before which the line paused for so long.
    pub(crate) fn received_after(&mut self, now_ns: i64, silence_ns: i64, is_streaming: bool) {
        if silence_ns >= PAUSE_NS {
            self.resumed_ns = now_ns;
        }
        if is_streaming && silence_ns >= SILENT_NS {
            // A silence that was listened to would have ended the stream: the host stood still, and telegrams
            // may be on their way.
            self.frame(now_ns);
        }
    }

    /// For how much of a silence the line was listened to: a port that was gone and is back was not silent.
    pub(crate) fn listened_ns(&self, now_ns: i64, silence_ns: i64) -> i64 {
        silence_ns.min(now_ns.saturating_sub(self.received_since_ns))
    }

    /// An intact telegram has come.
    pub(crate) fn frame(&mut self, now_ns: i64) {
        self.last_frame_ns = now_ns;
        self.last_sign_ns = now_ns;
    }

    /// The deframer's account: a telegram that failed its checksum is a sign of a device at the right rate.
    pub(crate) fn note_bad_checksums(&mut self, now_ns: i64, bad_checksums: u64) {
        if bad_checksums != self.bad_checksums {
            self.bad_checksums = bad_checksums;
            self.last_sign_ns = now_ns;
        }
    }

    /// The port is there again.
    pub(crate) fn port_back(&mut self, now_ns: i64, is_streaming: bool) {
        self.received_since_ns = now_ns;
        if is_streaming {
            self.frame(now_ns);
            self.resumed_ns = now_ns;
        }
    }

    /// The device begins to stream.
    pub(crate) fn stream_begins(&mut self, now_ns: i64) {
        self.frame(now_ns);
        self.last_byte_ns = now_ns;
    }

    /// After a pause a line on which bytes flow again gets as long again for a whole telegram, but not for
    /// ever. `period_ns` is from a telegram to the next, at most.
    fn garbled_deadline_ns(&self, period_ns: i64) -> i64 {
        let (without_sign_ns, without_frame_ns) =
            (GARBLED_NS.max(period_ns / 10 * 11), GARBLED_NS.max(period_ns / 2 * 5));
        let deadline_ns = |sign_ns: i64, frame_ns: i64| {
            sign_ns.saturating_add(without_sign_ns).min(frame_ns.saturating_add(without_frame_ns))
        };
        let plain_ns = deadline_ns(self.last_sign_ns, self.last_frame_ns);
        let resumed_ns =
            deadline_ns(self.last_sign_ns.max(self.resumed_ns), self.last_frame_ns.max(self.resumed_ns));
        let latest_ns = self.last_frame_ns.saturating_add(2 * without_frame_ns);
        let while_flowing_ns = self.last_byte_ns.saturating_add(PAUSE_NS);
        resumed_ns.min(plain_ns.max(while_flowing_ns)).min(latest_ns)
    }

    /// Until when something must come of a device that streams.
    pub(crate) fn silence_deadline_ns(&self, period_ns: i64) -> i64 {
        let silent_ns = silence::deadline_ns(self.last_byte_ns, SILENT_NS, self.received_since_ns);
        self.garbled_deadline_ns(period_ns).min(silent_ns)
    }

    /// What is wrong with a line on which nothing came in time.
    pub(crate) fn outage(&self, now_ns: i64) -> Event {
        let for_ms = |since_ns: i64| u32::try_from((now_ns - since_ns) / 1_000_000).unwrap_or(u32::MAX);
        if now_ns >= self.last_byte_ns.saturating_add(RECENT_NS) {
            Event::Silent { for_ms: for_ms(self.last_byte_ns) }
        } else {
            Event::Garbled { for_ms: for_ms(self.last_frame_ns) }
        }
    }
}
