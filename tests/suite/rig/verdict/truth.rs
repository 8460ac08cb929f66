//! What should have been recorded: telegrams cut out of what a device sent, and which of them arrived
//! untouched.
//!
//! The cutting is done on the clean bytes behind the device, with the mock's own checksum, not with the
//! driver's. A telegram has arrived untouched when all its bytes stand together in what the reads returned.

use std::collections::{HashMap, HashSet};
use std::hash::Hash;
use std::ops::Range;

use biplane_mock::devices::base::packet;
use biplane_mock::devices::lms::frame;
use biplane_onboard::Event;
use biplane_recording::Port;

use super::witness::{INVALID, NOTHING, RecordedScan};
use crate::rig::line::tape::Tape;
use crate::rig::{ReportedEvent, S};

/// A telegram that was on the line for longer than this after it was sent is not looked for any more: no
/// fault holds bytes so long.
const LONGEST_DELAY_NS: i64 = 2 * S;

/// A packet of a base may be recorded so much later than its last byte arrived.
pub(crate) const LONGEST_PARTIAL_FRAME_NS: i64 = S / 2;
/// The same behind bytes that came twice or in another order: they promise any length, 203 bytes for a
/// Pioneer, which reports 340 a second.
pub(crate) const LONGEST_PROMISE_NS: i64 = 3 * S / 4;

/// A telegram as it was sent.
#[derive(Clone, Debug)]
pub(crate) struct Telegram {
    /// When its last byte left.
    pub sent_ns: i64,
    /// All its bytes.
    pub bytes: Vec<u8>,
    /// When its last byte arrived, if all arrived untouched and together.
    pub arrived_ns: Option<i64>,
    /// Where it then stands in what arrived.
    pub place: Range<usize>,
}

/// Cuts a clean stream: `measure` gives the length of the whole intact telegram at the front of bytes, if one
/// is there.
pub(crate) fn cut(tape: &Tape, measure: impl Fn(&[u8]) -> Option<usize>) -> Vec<Telegram> {
    let mut telegrams = Vec::new();
    let mut at = 0;
    while at < tape.bytes.len() {
        match measure(&tape.bytes[at..]) {
            Some(length) => {
                let bytes = tape.bytes[at..at + length].to_vec();
                at += length;
                let sent_ns = tape.time_ns(at - 1);
                telegrams.push(Telegram { sent_ns, bytes, arrived_ns: None, place: 0..0 });
            }
            None => at += 1,
        }
    }
    telegrams
}

/// Length of the intact reply of a laser at the front.
fn lms_length(bytes: &[u8]) -> Option<usize> {
    let &[0x02, address, low, high, ..] = bytes else { return None };
    let length = usize::from(u16::from_le_bytes([low, high])) + 6;
    let telegram = bytes.get(..length).filter(|_| address >= 0x80 && length <= 820)?;
    let (covered, sum) = telegram.split_at(length - 2);
    (frame::checksum(covered).to_le_bytes() == sum).then_some(length)
}

/// Length of the intact packet of a Pioneer at the front.
fn p2os_length(bytes: &[u8]) -> Option<usize> {
    let &[0xFA, 0xFB, count, ..] = bytes else { return None };
    let length = usize::from(count) + 3;
    let body = bytes.get(3..length)?;
    let (body, sum) = body.split_at_checked(body.len().checked_sub(2)?)?;
    (packet::checksum(body).to_be_bytes() == sum).then_some(length)
}

/// Longest packet of a Pioneer, bytes.
const LONGEST_PACKET: usize = 210;

/// Whether an intact packet of a Pioneer tells of its odometry.
fn is_report(packet: &[u8]) -> bool {
    packet[2] > 17 && matches!(packet[3], 0x32 | 0x33)
}

/// Scans that a laser sent whole.
#[must_use]
pub(crate) fn sent_scans(sent: &Tape, delivered: &Tape) -> Vec<Telegram> {
    let mut telegrams = cut(sent, lms_length);
    telegrams.retain(|telegram| telegram.bytes[4] == 0xB0);
    find(&mut telegrams, delivered);
    telegrams
}

/// Odometry packets that a base sent whole.
fn sent_reports(sent: &Tape, delivered: &Tape) -> Vec<Telegram> {
    let mut packets = cut(sent, p2os_length);
    packets.retain(|packet| is_report(&packet.bytes));
    find(&mut packets, delivered);
    packets
}

/// Looks each telegram up in what arrived.
pub(crate) fn find(telegrams: &mut [Telegram], delivered: &Tape) {
    let mut from = 0;
    for telegram in telegrams {
        let until = delivered.index_after(telegram.sent_ns + LONGEST_DELAY_NS + delivered.held_ns);
        // What is near is looked at first: nearly all telegrams stand right where the last one ended.
        let found = byte_ranges(from, until, telegram.bytes.len())
            .find(|bytes| delivered.bytes[bytes.clone()] == telegram.bytes && delivered.is_in_one(bytes));
        if let Some(bytes) = found {
            telegram.arrived_ns = Some(delivered.time_ns(bytes.end - 1));
            from = bytes.end;
            telegram.place = bytes;
        }
    }
}

/// All places for so many bytes between two indices.
fn byte_ranges(from: usize, until: usize, length: usize) -> impl Iterator<Item = Range<usize>> {
    (from..(until + 1).saturating_sub(length)).map(move |start| start..start + length)
}

/// Ranges that a telegram with measuring mode 00 says, in millimeters (SICK telegram listing, B0 reply).
#[must_use]
pub(crate) fn ranges_mm(telegram: &[u8]) -> Option<Vec<u32>> {
    let &[low, high] = telegram.get(5..7)? else { return None };
    let word = u16::from_le_bytes([low, high]);
    let unit_mm = if word >> 14 == 1 { 1 } else { 10 };
    let values = telegram.get(7..7 + 2 * usize::from(word & 0x1FF))?;
    let ranges = values.chunks_exact(2).map(|pair| match u16::from_le_bytes([pair[0], pair[1]]) & 0x1FFF {
        8191 | 8183 => NOTHING,
        8183.. => INVALID,
        range => u32::from(range) * unit_mm,
    });
    Some(ranges.collect())
}

/// Times at which the session of a line had brought its device to stream, up to when the device lost its
/// settings.
fn wanted_spans(reported: &[ReportedEvent], port: Port) -> Vec<(i64, i64)> {
    let mut spans: Vec<(i64, i64)> = Vec::new();
    for reported in reported.iter().filter(|reported| reported.port == port) {
        match (&reported.event, spans.last_mut()) {
            (Event::Streaming, None) => spans.push((reported.at_ns, i64::MAX)),
            (Event::Streaming, Some(last)) if last.1 != i64::MAX => spans.push((reported.at_ns, i64::MAX)),
            (Event::PoweredOn, Some(last)) => last.1 = last.1.min(reported.at_ns),
            _ => {}
        }
    }
    spans
}

/// What became of a line's telegrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Account {
    /// Sent whole.
    pub sent: u64,
    /// Of them, arrived untouched while they were wanted.
    pub intact: u64,
    /// Of them, recorded.
    pub recorded: u64,
    /// Recorded, though nobody sent them so: damage that nothing can tell.
    pub undetected: u64,
    /// Recorded, though it could be told that they are damaged.
    pub wrongly_kept: u64,
    /// Sent whole, but damaged, cut or lost on the way.
    pub damaged: u64,
    /// Arrived untouched, but one that nobody can tell from true is made of damaged bytes and of its first
    /// ones, and was recorded instead.
    pub displaced: u64,
}

impl Account {
    /// Telegrams that should have been recorded and were not.
    #[must_use]
    pub(crate) fn lost(&self) -> u64 {
        self.intact - self.recorded
    }

    /// The sum of two.
    pub(crate) fn add(&mut self, other: &Self) {
        self.sent += other.sent;
        self.intact += other.intact;
        self.recorded += other.recorded;
        self.undetected += other.undetected;
        self.wrongly_kept += other.wrongly_kept;
        self.damaged += other.damaged;
        self.displaced += other.displaced;
    }
}

/// How measurements are told apart by what they say.
pub(crate) struct Contents<K> {
    /// Length of the intact telegram at the front of bytes.
    pub length: fn(&[u8]) -> Option<usize>,
    /// What a telegram says; `None` when it is no measurement.
    pub of: fn(&[u8]) -> Option<K>,
}

/// Holds what was recorded of a laser against what it sent.
#[must_use]
pub(crate) fn laser_account(
    port: Port,
    telegrams: &[Telegram],
    delivered: &Tape,
    recorded: &[RecordedScan],
    reported: &[ReportedEvent],
) -> Account {
    let spans = wanted_spans(reported, port);
    let is_wanted = |at_ns: i64| spans.iter().any(|&(from, to)| from <= at_ns && at_ns <= to);
    let contents = Contents { length: lms_length, of: ranges_mm };
    let recorded: Vec<_> = recorded.iter().map(|scan| (scan.log_ns, scan.ranges_mm.clone())).collect();
    account_by_contents(&contents, telegrams, delivered, &recorded, is_wanted)
}

/// Holds what was recorded, and when, against what was sent; those telegrams must be there that came when
/// they were wanted.
#[must_use]
pub(crate) fn account_by_contents<K: Eq + Hash>(
    contents: &Contents<K>,
    telegrams: &[Telegram],
    delivered: &Tape,
    recorded: &[(i64, K)],
    is_wanted: impl Fn(i64) -> bool,
) -> Account {
    let sent: HashMap<K, usize> =
        telegrams.iter().enumerate().filter_map(|(i, t)| Some(((contents.of)(&t.bytes)?, i))).collect();
    let kept: HashSet<usize> = recorded.iter().filter_map(|(_, says)| sent.get(says).copied()).collect();
    let mut account = Account { sent: telegrams.len() as u64, ..Account::default() };
    let mut untrue = Vec::new();
    // What a damaged telegram says may be all true, and yet its end be that of the next one's first bytes.
    let is_as_sent =
        |says| sent.get(says).is_some_and(|index: &usize| telegrams[*index].arrived_ns.is_some());
    for (log_ns, says) in recorded.iter().filter(|(_, says)| !is_as_sent(says)) {
        match that_passes_all_checks(contents, *log_ns, says, delivered) {
            Some(place) => untrue.push(place),
            None => account.wrongly_kept += 1,
        }
    }
    account.undetected = untrue.len() as u64;
    for (index, telegram) in telegrams.iter().enumerate() {
        let begins_inside = |place: &Range<usize>| place.contains(&telegram.place.start);
        match telegram.arrived_ns {
            Some(at_ns) if !is_wanted(at_ns) => {}
            Some(_) if kept.contains(&index) => {
                (account.intact, account.recorded) = (account.intact + 1, account.recorded + 1);
            }
            Some(_) if untrue.iter().any(begins_inside) => account.displaced += 1,
            Some(_) => account.intact += 1,
            None => account.damaged += 1,
        }
    }
    account
}

/// Where a telegram that says this, with a fitting checksum, really stands in what arrived until it was
/// recorded.
fn that_passes_all_checks<K: Eq>(
    contents: &Contents<K>,
    log_ns: i64,
    says: &K,
    delivered: &Tape,
) -> Option<Range<usize>> {
    let until = delivered.index_after(log_ns);
    let from = until.saturating_sub(4096);
    let telegram_at =
        |at: usize| (contents.length)(&delivered.bytes[at..until]).map(|length| at..at + length);
    (from..until)
        .filter_map(telegram_at)
        .find(|place| (contents.of)(&delivered.bytes[place.clone()]).as_ref() == Some(says))
}

/// Holds what was recorded of a Pioneer since `from_ns` against what it sent.
#[must_use]
pub(crate) fn pioneer_account(
    sent: &Tape,
    delivered: &Tape,
    from_ns: i64,
    recorded_ns: &[i64],
    reported: &[ReportedEvent],
    wait_ns: i64,
) -> Account {
    let mut packets = sent_reports(sent, delivered);
    let true_ones: HashSet<Vec<u8>> = packets.iter().map(|packet| packet.bytes.clone()).collect();
    packets.retain(|packet| packet.arrived_ns.is_none_or(|at_ns| at_ns >= from_ns));
    // A packet's sum does not see the order of its words.
    let passes_all_checks = |at_ns: i64| {
        let (from, until) = (delivered.index_after(at_ns - wait_ns), delivered.index_after(at_ns));
        (from.saturating_sub(LONGEST_PACKET)..until).any(|start| {
            p2os_length(&delivered.bytes[start..until]).is_some_and(|length| {
                is_report(&delivered.bytes[start..])
                    && !true_ones.contains(&delivered.bytes[start..start + length])
            })
        })
    };
    base_account(&packets, recorded_ns, reported, wait_ns, passes_all_checks)
}

/// Holds what was recorded of a base against what it sent: by order and times, because its poses are
/// continued over restarts. `passes_all_checks` tells whether what was recorded then, though not sent so, is
/// something that nobody can tell from true.
#[must_use]
pub(crate) fn base_account(
    packets: &[Telegram],
    recorded_ns: &[i64],
    reported: &[ReportedEvent],
    wait_ns: i64,
    passes_all_checks: impl Fn(i64) -> bool,
) -> Account {
    let untrue = |account: &mut Account, at_ns: i64| match passes_all_checks(at_ns) {
        true => account.undetected += 1,
        false => account.wrongly_kept += 1,
    };
    let first_ns = reported
        .iter()
        .find(|reported| reported.port == Port::Base && reported.event == Event::Streaming)
        .map_or(i64::MAX, |reported| reported.at_ns);
    let mut account = Account { sent: packets.len() as u64, ..Account::default() };
    let mut recorded = recorded_ns.iter().copied().peekable();
    for packet in packets {
        let Some(at_ns) = packet.arrived_ns else {
            account.damaged += 1;
            continue;
        };
        if at_ns < first_ns {
            // One of a session that was left open is as true as any.
            let is_recorded = recorded.next_if(|ns| (at_ns..=at_ns + wait_ns).contains(ns)).is_some();
            account.intact += u64::from(is_recorded);
            account.recorded += u64::from(is_recorded);
            continue;
        }
        account.intact += 1;
        while let Some(recorded_ns) = recorded.next_if(|recorded_ns| *recorded_ns < at_ns) {
            untrue(&mut account, recorded_ns);
        }
        // A packet behind a stump may have to wait until the stump is known to be one.
        let waited = recorded.next_if(|recorded_ns| recorded_ns - at_ns <= wait_ns);
        account.recorded += u64::from(waited.is_some());
    }
    recorded.for_each(|recorded_ns| untrue(&mut account, recorded_ns));
    account
}
