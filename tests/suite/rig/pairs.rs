//! Measurements of a base that are two things: an rFLEX base's reports of both axes, a RoboClaw's answer with
//! its question.
//!
//! Cut out of the clean bytes behind the device by the frame rules of the manuals, with the mock's own sums,
//! not with the driver's.

use biplane_mock::devices::base::roboclaw::crc;

use super::MS;
use crate::rig::line::tape::Tape;
use crate::rig::verdict::truth::{Telegram, cut, find};

/// Command of a RoboClaw for both encoders, and the bytes of its answer.
const ENCODERS: (u8, usize) = (78, 10);
/// Other answers of fixed length: battery, wide status.
const OTHERS: [(u8, usize); 2] = [(24, 4), (90, 6)];
/// Command for the version, a text that a zero ends.
const VERSION: u8 = 21;
/// An answer that comes later than this may have been given up.
const PROMPT_NS: i64 = 60 * MS;

/// Length of the intact packet of an rFLEX base at the front: `1B 02 | port | id | opcode | n | n bytes | xor
/// | 1B 03`.
fn rflex_length(bytes: &[u8]) -> Option<usize> {
    let &[0x1B, 0x02, _, _, _, count, ..] = bytes else { return None };
    let length = usize::from(count) + 9;
    let [body @ .., sum, 0x1B, 0x03] = bytes.get(2..length)? else { return None };
    (body.iter().fold(0, |xor, byte| xor ^ byte) == *sum).then_some(length)
}

/// Reports of both axes that an rFLEX base made at one moment of its clock; arrived when both did.
#[must_use]
pub(crate) fn sent_axes(sent: &Tape, delivered: &Tape) -> Vec<Telegram> {
    let mut reports = cut(sent, rflex_length);
    // Port 2, opcode 33; its time stands behind a word, its axis behind the time.
    reports.retain(|report| report.bytes[2] == 2 && report.bytes[4] == 33 && report.bytes.len() == 34);
    find(&mut reports, delivered);
    let moments = reports.chunk_by(|a, b| a.bytes[10..14] == b.bytes[10..14]);
    let both = moments.filter_map(|moment| match moment {
        [way, bearing] if (way.bytes[14], bearing.bytes[14]) == (0, 1) => Some(Telegram {
            sent_ns: bearing.sent_ns,
            bytes: [&way.bytes[..], &bearing.bytes].concat(),
            arrived_ns: way.arrived_ns.and(bearing.arrived_ns),
            place: 0..0,
        }),
        _ => None,
    });
    both.collect()
}

/// Length of the intact answer of a RoboClaw at the front, whatever it was asked.
fn roboclaw_length(address: u8, bytes: &[u8]) -> Option<usize> {
    let fits = |command: u8, length: usize| {
        let (data, sum) = bytes.get(..length)?.split_at(length - 2);
        (crc(&[&[address, command], data].concat()).to_be_bytes() == sum).then_some(length)
    };
    let fixed = [ENCODERS].into_iter().chain(OTHERS).find_map(|(command, length)| fits(command, length));
    fixed.or_else(|| fits(VERSION, bytes.iter().take(48).position(|byte| *byte == 0)? + 3))
}

/// Answers of a RoboClaw to questions for both encoders. One has arrived when it is all that came between its
/// question and its own end, and came soon: without its question it means nothing, and behind other bytes it
/// may be another one.
#[must_use]
pub(crate) fn sent_counts(address: u8, asked: &Tape, sent: &Tape, delivered: &Tape) -> Vec<Telegram> {
    let mut answers = cut(sent, |bytes| roboclaw_length(address, bytes));
    answers.retain(|answer| answer.bytes.len() == ENCODERS.1);
    let questions: Vec<(i64, &[u8])> = asked.pieces().collect();
    for answer in &mut answers {
        let next = questions.partition_point(|(at_ns, _)| *at_ns < answer.sent_ns);
        let Some(&(asked_ns, question)) = next.checked_sub(1).map(|last| &questions[last]) else { continue };
        let next_ns = questions.get(next).map_or(i64::MAX, |(at_ns, _)| *at_ns);
        let (from, until) =
            (delivered.index_after(asked_ns), delivered.index_after(next_ns.min(asked_ns + PROMPT_NS)));
        let came = delivered.bytes.get(from..until).unwrap_or_default();
        let end = from + answer.bytes.len();
        if question == [address, ENCODERS.0] && came.starts_with(&answer.bytes) && delivered.is_end(end) {
            answer.arrived_ns = Some(delivered.time_ns(end - 1));
        }
    }
    answers
}
