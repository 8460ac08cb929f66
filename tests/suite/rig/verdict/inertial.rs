//! Which messages an inertial unit sent, which of them arrived untouched, and what became of them.
//!
//! Cut out of the clean bytes by the manual's frame rules (`FA FF | MID | length | data | sum`), as those of
//! lasers are: not by the driver's.

use super::truth::{Account, Contents, Telegram, account_by_contents, cut, find};
use super::witness::RecordedSample;
use crate::rig::line::tape::Tape;
use crate::rig::world::Felt;

/// What a sample says, as bits.
type Numbers = [u32; 6];

const CONTENTS: Contents<Numbers> = Contents { length: message_length, of: numbers };

/// Length of the intact message at the front.
fn message_length(bytes: &[u8]) -> Option<usize> {
    let length = match *bytes {
        [0xFA, 0xFF, _, 0xFF, high, low, ..] => usize::from(u16::from_be_bytes([high, low])) + 7,
        [0xFA, 0xFF, _, length, ..] => usize::from(length) + 5,
        _ => return None,
    };
    let message = bytes.get(..length)?;
    (message[1..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) == 0).then_some(length)
}

/// The numbers of a measurement that has all of count, time, accelerations and turn rates.
fn numbers(message: &[u8]) -> Option<Numbers> {
    let mut items = match *message {
        [0xFA, 0xFF, 0x36, 0xFF, _, _, ref items @ .., _] | [0xFA, 0xFF, 0x36, _, ref items @ .., _] => items,
        _ => return None,
    };
    let (mut turns, mut forces, mut words) = (None, None, 0);
    while let [high, low, length, rest @ ..] = items {
        let (item, behind) = rest.split_at_checked(usize::from(*length))?;
        let identifier = u16::from_be_bytes([*high, *low]);
        match (identifier & 0xFFF0, item.len()) {
            (0x1020, 2) | (0x1060, 4) => words += 1,
            (0x8020, 12) => turns = Some(vector(identifier & 3, item)),
            (0x4020, 12) => forces = Some(vector(identifier & 3, item)),
            _ => {}
        }
        items = behind;
    }
    let (turns, forces) = turns.zip(forces).filter(|_| words >= 2)?;
    Some([turns[0], turns[1], turns[2], forces[0], forces[1], forces[2]])
}

/// Numbers of 32 bits; a damaged identifier makes integers in millionths (1 / 2^20) of them.
fn vector(precision: u16, item: &[u8]) -> [u32; 3] {
    let word = |axis: usize| u32::from_be_bytes([0, 1, 2, 3].map(|byte| item[4 * axis + byte]));
    std::array::from_fn(|axis| match precision {
        1 => ((f64::from(word(axis).cast_signed()) / f64::from(1 << 20)) as f32).to_bits(),
        _ => word(axis),
    })
}

/// Samples that a unit sent whole.
#[must_use]
pub(crate) fn sent_samples(sent: &Tape, delivered: &Tape) -> Vec<Telegram> {
    let mut messages = cut(sent, message_length);
    messages.retain(|message| numbers(&message.bytes).is_some());
    find(&mut messages, delivered);
    messages
}

/// Holds what was recorded of a unit against what it sent. Whatever arrives whole is wanted, in every state
/// of the session.
#[must_use]
pub(crate) fn inertial_account(
    messages: &[Telegram],
    delivered: &Tape,
    recorded: &[RecordedSample],
) -> Account {
    let recorded: Vec<_> =
        recorded.iter().map(|sample| (sample.log_ns, sample.numbers.map(f32::to_bits))).collect();
    account_by_contents(&CONTENTS, messages, delivered, &recorded, |_| true)
}

/// Stamps of samples less the time at which each was taken, milliseconds.
pub(crate) fn stamp_errors_ms(recorded: &[RecordedSample]) -> impl Iterator<Item = f64> {
    recorded.iter().map(|sample| {
        let taken_ns = Felt::taken_ns(f64::from(sample.numbers[0]), f64::from(sample.numbers[3]));
        (sample.stamp_ns - taken_ns) as f64 * 1e-6
    })
}
