//! From the reads of a port to the time at which a telegram's first byte left its device.
//!
//! A read that returned at t and brought b bytes of a telegram says: the first byte left at t - b byte times,
//! or earlier. The smallest of these bounds is the estimate. How good it is shows in the reads themselves:
//! bytes that came one after another at the line's pace cannot have been held back all together, bytes that
//! came at once can. Nanoseconds; byte offsets since the port was opened.

/// Reads that are remembered; a telegram that came in more reads is stamped from its last ones. Even one byte
/// a read, the longest telegram fits.
const REMEMBERED_READS: usize = 1024;
/// By how many millionths a device may send faster than its nominal rate. An LMS divides its clock by 26, 52
/// and 104 where 500000 Bd are a division by 2, so its 38400 Bd are 38461.5 (rate codes of the status
/// telegram): 0.16 % faster. Larger: the last bytes of a long telegram say less; smaller: a fast device is
/// stamped too early.
const FAST_PPM: i64 = 2000;
/// Up to this time on the line that makes no difference worth regard (0.1 ms), nanoseconds.
const SHORT_NS: i64 = 50_000_000;
/// Reads whose departures differ by no more than this agree, nanoseconds: three times what a read is late on
/// average.
const AGREE_NS: i64 = 800_000;
/// Agreeing reads count when they lie so far apart on the line, nanoseconds ...
const APART_NS: i64 = 700_000;
/// ... and the first and the last so far ...
const SPAN_NS: i64 = 2_500_000;
/// ... and there are so many.
const AGREEING: u32 = 4;
/// When a part of a telegram came and then nothing for so long, nanoseconds, that part was all that there
/// was: a latency timer ran out, or a stall began. Longer than the usual hiccups of an adapter, which delay
/// what is there.
const PAUSE_NS: i64 = 10_500_000;

/// A reader that does all in time has listened less than this before a read returns, nanoseconds: its rest,
/// and two waits for bytes.
pub(crate) const IN_TIME_NS: i64 = 20_000_000;

/// A telegram in its line's stream of bytes.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Extent {
    /// Index of its first byte.
    pub offset: u64,
    /// Its bytes.
    pub length: usize,
    /// Time of a byte on the line, nanoseconds.
    pub byte_ns: i64,
    /// Bytes that the device sends without a pause; later ones may come late without having been held back.
    pub burst: usize,
    /// The next telegram leaves this much later at the soonest, nanoseconds.
    pub spacing_ns: i64,
}

/// How a telegram's bytes came.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Pace {
    /// At once: they may have been held back for long.
    AtOnce,
    /// One after another, though not as regularly as the line sent them.
    Spread,
    /// At the line's pace: they were not held back.
    Line,
}

/// When a telegram's first byte left, as its reads allow.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Bound {
    /// Not later than this, nanoseconds.
    pub time_ns: i64,
    /// What that is worth.
    pub pace: Pace,
    /// Whether nobody listened when any of it came: it may be older than its reads by as much as the host
    /// stood still.
    pub is_overdue: bool,
}

#[derive(Copy, Clone, Debug, Default)]
struct Read {
    end_offset: u64,
    time_ns: i64,
    /// For how long before nobody had listened.
    unheard_ns: i64,
}

impl Read {
    /// Whether the host came too late for it.
    fn is_overdue(&self) -> bool {
        self.unheard_ns > IN_TIME_NS
    }

    /// Whether nothing came for long since the read before it. A host that did not look is no sign of that.
    fn is_behind_pause(&self, before: &Self) -> bool {
        let gap_ns = self.time_ns - before.time_ns;
        gap_ns >= PAUSE_NS && self.unheard_ns < gap_ns
    }
}

/// The latest reads of one port: up to which byte, and when.
#[derive(Clone, Debug)]
pub(crate) struct Arrivals {
    reads: Box<[Read; REMEMBERED_READS]>,
    pushed: usize,
}

impl Default for Arrivals {
    fn default() -> Self {
        Self { reads: Box::new([Read::default(); REMEMBERED_READS]), pushed: 0 }
    }
}

impl Arrivals {
    /// A read that returned at `time_ns`, of a port that is always listened to, and brought the stream to
    /// `end_offset` bytes.
    #[cfg(test)]
    pub(crate) fn push(&mut self, end_offset: u64, time_ns: i64) {
        self.push_read(end_offset, time_ns, 0);
    }

    /// The same of a read of which is known for how long nobody had listened when it returned, nanoseconds.
    pub(crate) fn push_read(&mut self, end_offset: u64, time_ns: i64, unheard_ns: i64) {
        if let Some(read) = self.reads.get_mut(self.pushed % REMEMBERED_READS) {
            *read = Read { end_offset, time_ns, unheard_ns };
            self.pushed += 1;
        }
    }

    /// When the first byte of a telegram that has arrived left the device. `None` when no read of it is
    /// remembered.
    #[must_use]
    pub(crate) fn departure(&self, telegram: &Extent) -> Option<Bound> {
        let end = telegram.offset.saturating_add(telegram.length as u64);
        let (mut first, mut last) = (0, 1);
        for back in 1..=self.pushed.min(REMEMBERED_READS) {
            let read = self.back(back);
            if read.end_offset <= telegram.offset {
                break;
            }
            first = back;
            if read.end_offset >= end {
                last = back;
            }
        }
        if first == 0 {
            return None;
        }
        let is_paced = self.is_paced(telegram, first, last);
        let took_ns = self.back(last).time_ns.saturating_sub(self.back(first).time_ns);
        let pace = match is_paced {
            true => Pace::Line,
            false if took_ns >= telegram.line_ns(telegram.length as u64) / 2 => Pace::Spread,
            false => Pace::AtOnce,
        };
        let bound_ns = |back: usize| {
            let read = self.back(back);
            let line_ns = telegram.line_ns(read.end_offset.min(end) - telegram.offset);
            // Without the slack, one read of a whole telegram would seem late; with it, many reads say what
            // the first ones say.
            let slack_ns = if is_paced { (line_ns - SHORT_NS).max(0) / 1_000_000 * FAST_PPM } else { 0 };
            read.time_ns.saturating_sub(line_ns - slack_ns)
        };
        let own_ns = (last..=first).map(bound_ns).min()?;
        let time_ns = if is_paced { own_ns } else { own_ns.min(self.with_what_follows(telegram, end, last)) };
        let is_overdue = (last..=first).all(|back| self.back(back).is_overdue());
        Some(Bound { time_ns, pace, is_overdue })
    }

    /// The read that came `back`-th from the end (1 = the last).
    fn back(&self, back: usize) -> Read {
        self.reads[(self.pushed - back) % REMEMBERED_READS]
    }

    /// Whether the reads show that the line was still carrying the telegram while they came.
    fn is_paced(&self, telegram: &Extent, first: usize, last: usize) -> bool {
        let end = telegram.offset.saturating_add((telegram.length.min(telegram.burst)) as u64);
        let within =
            || (last..=first).rev().map(|back| self.back(back)).filter(|read| read.end_offset <= end);
        let line_ns = |read: &Read| telegram.line_ns(read.end_offset - telegram.offset);
        let Some(earliest_ns) = within().map(|read| read.time_ns - line_ns(&read)).min() else {
            return false;
        };
        let (mut agreeing, mut begin_ns, mut before_ns) = (0, 0, i64::MIN / 2);
        for read in within() {
            let at_ns = line_ns(&read);
            if read.time_ns - at_ns > earliest_ns + AGREE_NS || at_ns < before_ns + APART_NS {
                continue;
            }
            begin_ns = if agreeing == 0 { at_ns } else { begin_ns };
            (agreeing, before_ns) = (agreeing + 1, at_ns);
            if agreeing >= AGREEING && at_ns - begin_ns >= SPAN_NS {
                return true;
            }
        }
        (last + 1..=first).any(|back| {
            let (read, next) = (self.back(back), self.back(back - 1));
            read.end_offset < end && next.is_behind_pause(&read)
        })
    }

    /// What the last read tells when it brought more than the telegram: the bytes behind it left later, those
    /// of further telegrams later still.
    fn with_what_follows(&self, telegram: &Extent, end: u64, last: usize) -> i64 {
        let read = self.back(last);
        let Some(more) = read.end_offset.checked_sub(end + 1) else { return i64::MAX };
        let length = telegram.length.max(1) as u64;
        let between = i64::try_from(more / length).unwrap_or(i64::MAX).saturating_add(1);
        let line_ns = telegram.line_ns(more % length + 1);
        read.time_ns.saturating_sub(line_ns).saturating_sub(telegram.spacing_ns.saturating_mul(between))
    }
}

impl Extent {
    fn line_ns(&self, bytes: u64) -> i64 {
        self.byte_ns.saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX))
    }
}
