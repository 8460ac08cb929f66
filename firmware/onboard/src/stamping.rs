//! From read times to the time at which a telegram's first byte left its device.
//!
//! A read returns some time after its last byte was on the line: late by what the adapter adds (about 0.3 ms, now and
//! then 8 ms), never early. Two lower envelopes remove most of that. [`Arrivals`] takes, over all reads that a telegram
//! came in, the earliest departure of its first byte that fits the line's rate. [`TurnClock`] then follows the departures of
//! a laser's scans, which lie whole mirror turns apart. All is causal: a stamp uses what has arrived, nothing later.
//! Units: nanoseconds of the host's time; byte offsets since the port was opened. Model: `interfaces.md` section 2.

use biplane_wire::lms::MIRROR_TURN_NS;

/// Bits that a byte takes on the line: start, eight data, stop.
const LINE_BITS_PER_BYTE: i64 = 10;
/// Reads that are remembered; a telegram that came in more reads is stamped from its last ones.
const REMEMBERED_READS: usize = 256;

/// How long one byte takes on the line, nanoseconds, at a rate in bits per second.
#[must_use]
pub fn byte_time_ns(baud: u32) -> i64 {
    LINE_BITS_PER_BYTE * 1_000_000_000 / i64::from(baud.max(1))
}

#[derive(Copy, Clone, Debug, Default)]
struct Read {
    end_offset: u64,
    time_ns: i64,
}

/// The latest reads of one port: up to which byte, and when.
#[derive(Clone, Debug)]
pub struct Arrivals {
    reads: Box<[Read; REMEMBERED_READS]>,
    pushed: usize,
}

impl Default for Arrivals {
    fn default() -> Self {
        Self { reads: Box::new([Read::default(); REMEMBERED_READS]), pushed: 0 }
    }
}

impl Arrivals {
    /// A read that returned at `time_ns` and brought the stream to `end_offset` bytes.
    pub fn push(&mut self, end_offset: u64, time_ns: i64) {
        if let Some(read) = self.reads.get_mut(self.pushed % REMEMBERED_READS) {
            *read = Read { end_offset, time_ns };
            self.pushed += 1;
        }
    }

    /// The earliest time at which the first byte of a telegram may have left the device: the smallest estimate over all
    /// reads that brought bytes of it. `None` when no such read is remembered.
    #[must_use]
    pub fn departure_ns(&self, offset: u64, length: usize, byte_ns: i64) -> Option<i64> {
        let end = offset.saturating_add(length as u64);
        let mut earliest = None;
        for back in 1..=self.pushed.min(REMEMBERED_READS) {
            let read = self.reads[(self.pushed - back) % REMEMBERED_READS];
            if read.end_offset <= offset {
                break;
            }
            let bytes = read.end_offset.min(end) - offset;
            let on_the_line_ns = byte_ns.saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX));
            let departure_ns = read.time_ns.saturating_sub(on_the_line_ns);
            earliest = Some(earliest.map_or(departure_ns, |other: i64| other.min(departure_ns)));
        }
        earliest
    }
}

/// How a [`TurnClock`] smooths.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TurnClockParams {
    /// By how many millionths the envelope rises faster than the nominal mirror. Larger: follows a slow mirror, strays
    /// further between two prompt reads. Smaller than the mirror's deviation: stamps fall behind until the next lift.
    pub rise_ppm: f64,
    /// A gap after which nothing is known of the phase, nanoseconds. Larger: an old phase survives a standstill.
    pub gap_ns: i64,
    /// Scans over which every departure must lie above the envelope before it is lifted. Smaller: reacts sooner,
    /// mistakes a run of late reads for a change of phase.
    pub window_scans: u32,
    /// How far above the envelope they must lie, nanoseconds. Larger: tolerates a standing error of that size.
    pub lift_ns: i64,
}

impl Default for TurnClockParams {
    fn default() -> Self {
        Self { rise_ppm: 150.0, gap_ns: 5_000_000_000, window_scans: 32, lift_ns: 400_000 }
    }
}

/// Follows the departures of one laser's scans: a lower envelope on a grid of whole scans.
#[derive(Clone, Debug)]
pub struct TurnClock {
    params: TurnClockParams,
    envelope_ns: Option<i64>,
    window_min_ns: i64,
    window_count: u32,
}

impl TurnClock {
    /// A clock that has seen nothing.
    #[must_use]
    pub fn new(params: TurnClockParams) -> Self {
        Self { params, envelope_ns: None, window_min_ns: i64::MAX, window_count: 0 }
    }

    /// Forgets the phase: the device was started anew.
    pub fn reset(&mut self) {
        *self = Self::new(self.params);
    }

    /// The smoothed departure of the scan whose departure was estimated as `departure_ns`; `turns` is its number of mirror
    /// turns (1, 2 or 4). Never later than the estimate, and less than one scan earlier.
    pub fn smooth(&mut self, departure_ns: i64, turns: u8) -> i64 {
        let Some(predicted_ns) = self.predict(departure_ns, turns) else {
            return self.restart(departure_ns);
        };
        let late_ns = departure_ns - predicted_ns;
        if late_ns <= 0 {
            return self.restart(departure_ns);
        }
        self.window_min_ns = self.window_min_ns.min(late_ns);
        self.window_count += 1;
        let mut envelope_ns = predicted_ns;
        if self.window_count >= self.params.window_scans {
            if self.window_min_ns > self.params.lift_ns {
                envelope_ns += self.window_min_ns;
            }
            self.window_min_ns = i64::MAX;
            self.window_count = 0;
        }
        self.envelope_ns = Some(envelope_ns);
        envelope_ns
    }

    /// Where the envelope lies at the scan nearest to a departure; `None` when nothing is known of it. Reads come late,
    /// so a departure may lie up to three quarters of a scan above its envelope and one quarter below.
    fn predict(&self, departure_ns: i64, turns: u8) -> Option<i64> {
        let elapsed_ns = departure_ns.checked_sub(self.envelope_ns?)?;
        if elapsed_ns < 0 || elapsed_ns > self.params.gap_ns {
            return None;
        }
        let scan_ns = MIRROR_TURN_NS * i64::from(turns.max(1));
        let scans = ((elapsed_ns + scan_ns / 4) / scan_ns).max(1);
        let nominal_ns = scans * scan_ns;
        let rise_ns = (nominal_ns as f64 * self.params.rise_ppm * 1e-6) as i64;
        Some(self.envelope_ns? + nominal_ns + rise_ns)
    }

    fn restart(&mut self, departure_ns: i64) -> i64 {
        self.envelope_ns = Some(departure_ns);
        self.window_min_ns = i64::MAX;
        self.window_count = 0;
        departure_ns
    }
}

#[cfg(test)]
mod tests;
