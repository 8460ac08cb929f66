//! A device's end of the line: bytes leave one after another, at the line's rate and not before their time.
//!
//! Times are nanoseconds on the caller's clock. A byte takes ten bit times (8N1) and counts as sent when its
//! stop bit ends. An LMS puts at most 508 bytes of a scan on the line in one mirror turn (SICK telegram
//! listing, figures on data output), which shows at 500000 Bd only.

use crate::line::transfer_ns;
use std::collections::VecDeque;

/// Bytes are handed out in portions of this length, so that a mock need not wake for each of them. The first
/// byte of a transmission is a portion of its own: clients stamp it.
const PORTION_NS: i64 = 1_000_000;

/// What a transmission is; decides who may interrupt it and what its end sets off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A single byte 06 or 15.
    Acknowledge,
    /// A reply without consequences.
    Reply,
    /// The reply to a write to the EEPROM, which goes on until then.
    ReplyToWrite,
    /// The reply after which the device works at another rate, in Bd.
    ReplyThenBaud(u32),
    /// The reply after which the device starts afresh.
    ReplyThenReset,
    /// A scan or another unasked packet.
    Stream,
}

/// At most `bytes` bytes go out in each `period_ns`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Burst {
    /// Bytes a period.
    pub bytes: usize,
    /// Length of a period, nanoseconds.
    pub period_ns: i64,
}

/// Bytes that wait for their time or are on their way out.
#[derive(Clone, Debug)]
struct Transmission {
    start_ns: i64,
    baud: u32,
    kind: Kind,
    bytes: Vec<u8>,
    sent: usize,
    burst: Option<Burst>,
}

impl Transmission {
    /// When the byte of this index has left.
    fn due_ns(&self, index: usize) -> i64 {
        let plain = self.start_ns + transfer_ns(index + 1, self.baud);
        match self.burst {
            Some(burst) if transfer_ns(burst.bytes, self.baud) < burst.period_ns => {
                let periods = i64::try_from(index / burst.bytes).unwrap_or(0);
                self.start_ns + periods * burst.period_ns + transfer_ns(index % burst.bytes + 1, self.baud)
            }
            _ => plain,
        }
    }

    fn end_ns(&self) -> i64 {
        self.due_ns(self.bytes.len().saturating_sub(1))
    }
}

/// The sending side of a line: transmissions in order, none overlapping another.
#[derive(Debug, Default)]
pub struct Line {
    queue: VecDeque<Transmission>,
    free_ns: i64,
}

impl Line {
    /// When everything that is queued has left; in the past when nothing is.
    #[must_use]
    pub fn free_ns(&self) -> i64 {
        self.free_ns
    }

    /// Whether nothing waits and nothing is being sent.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.queue.is_empty()
    }

    /// Whether a reply or an acknowledgement still has to go out.
    #[must_use]
    pub fn owes_reply(&self) -> bool {
        self.queue.iter().any(|transmission| transmission.kind != Kind::Stream)
    }

    /// Whether a write to the EEPROM goes on.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        self.queue.iter().any(|transmission| transmission.kind == Kind::ReplyToWrite)
    }

    /// Queues bytes: the first leaves at `start_ns`, or when the line is free if that is later. Returns the
    /// time used.
    pub fn send(
        &mut self,
        start_ns: i64,
        baud: u32,
        kind: Kind,
        bytes: Vec<u8>,
        burst: Option<Burst>,
    ) -> i64 {
        let start_ns = start_ns.max(self.free_ns);
        if !bytes.is_empty() {
            let transmission = Transmission { start_ns, baud, kind, bytes, sent: 0, burst };
            self.free_ns = transmission.end_ns();
            self.queue.push_back(transmission);
        }
        start_ns
    }

    /// Sends an acknowledgement ahead of replies that have not begun: an LMS acknowledges at once and answers
    /// later.
    pub fn acknowledge(&mut self, start_ns: i64, baud: u32, byte: u8) -> i64 {
        let begun = self.queue.iter().take_while(|t| t.sent > 0 || t.start_ns <= start_ns).count();
        let busy_ns = if begun > 0 { self.queue[begun - 1].end_ns() } else { start_ns };
        let start_ns = start_ns.max(busy_ns);
        let transmission =
            Transmission { start_ns, baud, kind: Kind::Acknowledge, bytes: vec![byte], sent: 0, burst: None };
        let mut free_ns = transmission.end_ns();
        self.queue.insert(begun, transmission);
        for later in self.queue.iter_mut().skip(begun + 1) {
            later.start_ns = later.start_ns.max(free_ns);
            free_ns = later.end_ns();
        }
        self.free_ns = free_ns;
        start_ns
    }

    /// Drops what is being sent now and every unasked packet. Returns the bytes that never left and the reply
    /// that was cut, if it was one, else the packet.
    pub fn interrupt(&mut self, now_ns: i64) -> (usize, Option<Kind>) {
        let mut cut = (0, None);
        let mut kept = VecDeque::new();
        for transmission in self.queue.drain(..) {
            let started = transmission.sent > 0 || transmission.start_ns <= now_ns;
            if transmission.kind == Kind::Stream || started {
                cut.0 += transmission.bytes.len() - transmission.sent;
                cut.1 = cut.1.filter(|kind| *kind != Kind::Stream).or(Some(transmission.kind));
            } else {
                kept.push_back(transmission);
            }
        }
        self.free_ns = kept.back().map_or(now_ns, Transmission::end_ns);
        self.queue = kept;
        cut
    }

    /// Forgets everything.
    pub fn clear(&mut self, now_ns: i64) {
        self.queue.clear();
        self.free_ns = now_ns;
    }

    /// Appends the bytes that have left by `now_ns` to `out`, up to the end of one transmission; its kind
    /// when it ended.
    pub fn take(&mut self, now_ns: i64, out: &mut Vec<u8>) -> Option<Kind> {
        let first = self.queue.front_mut()?;
        while first.sent < first.bytes.len() && first.due_ns(first.sent) <= now_ns {
            out.push(first.bytes[first.sent]);
            first.sent += 1;
        }
        if first.sent < first.bytes.len() {
            return None;
        }
        self.queue.pop_front().map(|transmission| transmission.kind)
    }

    /// When it is worth calling [`Line::take`] again: the first byte of a transmission, then a portion, then
    /// its end.
    #[must_use]
    pub fn next_due_ns(&self) -> Option<i64> {
        let first = self.queue.front()?;
        let next_ns = first.due_ns(first.sent);
        if first.sent == 0 {
            Some(next_ns)
        } else {
            Some(next_ns.max((next_ns + PORTION_NS).min(first.end_ns())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(line: &mut Line) -> Vec<(i64, usize)> {
        let mut portions = Vec::new();
        while let Some(due_ns) = line.next_due_ns() {
            let mut out = Vec::new();
            line.take(due_ns, &mut out);
            portions.push((due_ns, out.len()));
        }
        portions
    }

    #[test]
    fn a_scan_of_732_bytes_takes_190_6_ms_at_38400_and_its_first_byte_comes_alone() {
        let mut line = Line::default();
        line.send(0, 38_400, Kind::Stream, vec![0; 732], Some(Burst { bytes: 508, period_ns: 13_320_000 }));
        let portions = run(&mut line);
        assert_eq!(portions[0], (260_416, 1));
        assert_eq!(portions.iter().map(|portion| portion.1).sum::<usize>(), 732);
        assert_eq!(portions.last().map(|portion| portion.0), Some(190_625_000));
    }

    #[test]
    fn at_500000_a_long_scan_pauses_after_508_bytes_until_the_next_mirror_turn() {
        let mut line = Line::default();
        line.send(0, 500_000, Kind::Stream, vec![0; 732], Some(Burst { bytes: 508, period_ns: 13_320_000 }));
        let mut out = Vec::new();
        line.take(13_320_000, &mut out);
        assert_eq!(out.len(), 508);
        assert_eq!(line.free_ns(), 13_320_000 + 224 * 20_000);
    }

    #[test]
    fn an_interruption_drops_the_scan_on_the_line_but_not_a_reply_that_has_not_begun() {
        let mut line = Line::default();
        line.send(0, 9600, Kind::Stream, vec![1; 100], None);
        line.send(0, 9600, Kind::ReplyThenBaud(38_400), vec![2; 9], None);
        let mut out = Vec::new();
        line.take(10_500_000, &mut out);
        assert_eq!(out.len(), 10);
        assert_eq!(line.interrupt(10_500_000), (90, Some(Kind::Stream)));
        assert!(line.owes_reply());
    }

    #[test]
    fn an_acknowledgement_goes_out_before_a_reply_that_still_waits() {
        let mut line = Line::default();
        line.send(50_000_000, 9600, Kind::Reply, vec![2; 9], None);
        line.acknowledge(10_000_000, 9600, 6);
        let mut out = Vec::new();
        assert_eq!(line.take(12_000_000, &mut out), Some(Kind::Acknowledge));
        assert_eq!(out, [6]);
    }
}
