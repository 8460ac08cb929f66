//! What a mock laser sends unasked: whole scans, means, sub-ranges, single turns; and the telegrams that carry them.
//!
//! Source: SICK telegram listing, 20h sub-commands 24, 26, 27, 2A, and replies B0, B6, B7.

use super::feed::Offer;
use super::frame::reply;
use super::settings::Variant;
use super::words::{Scale, range_mask};
use crate::source::ScanWords;

/// What is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Nothing unasked (20 25).
    OnRequest,
    /// One whole scan, then what was sent before (30 01).
    Once {
        /// Whether whole scans go on afterwards.
        then_all: bool,
    },
    /// Whole scans (20 24).
    All,
    /// Each turn by itself, always over 180 degrees (20 2A).
    Partial,
    /// Mean of n scans (20 26 n).
    Mean(u8),
    /// Values first..=last, counted from 1 (20 27).
    SubRange {
        /// First value.
        first: u16,
        /// Last value.
        last: u16,
    },
}

impl Output {
    /// The output that a sub-command of 20h asks for; `None` when the device does not know it or the arguments are out of range.
    #[must_use]
    pub fn of_mode(sub: u8, arguments: &[u8], variant: Variant) -> Option<Self> {
        match (sub, arguments) {
            (0x24, []) => Some(Self::All),
            (0x25, []) => Some(Self::OnRequest),
            (0x26, [n @ 2..=250]) => Some(Self::Mean(*n)),
            (0x27, &[a, b, c, d]) => {
                let (first, last) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
                let inside = first >= 1 && first <= last && usize::from(last) <= variant.beam_count();
                inside.then_some(Self::SubRange { first, last })
            }
            (0x2A, []) => Some(Self::Partial),
            _ => None,
        }
    }

    /// One scan now, and afterwards what was sent before.
    #[must_use]
    pub fn once(before: Self) -> Self {
        Self::Once { then_all: before == Self::All }
    }

    /// What goes on after a telegram.
    #[must_use]
    pub fn after_telegram(self) -> Self {
        match self {
            Self::Once { then_all: true } => Self::All,
            Self::Once { then_all: false } => Self::OnRequest,
            other => other,
        }
    }

    /// Whether scans come without being asked for.
    #[must_use]
    pub fn is_streaming(self) -> bool {
        !matches!(self, Self::OnRequest | Self::Once { .. })
    }

    /// Turns from one possible telegram to the next.
    #[must_use]
    pub fn turns(self, variant: Variant) -> i64 {
        match self {
            Self::Partial => 1,
            Self::Mean(n) => i64::from(n) * variant.turns(),
            _ => variant.turns(),
        }
    }

    /// The variant whose scans the telegrams are made of.
    #[must_use]
    pub fn source_variant(self, variant: Variant) -> Variant {
        match self {
            Self::Partial if variant.turns() > 1 => Variant::of(180, 50),
            Self::Partial => Variant::of(180, 100),
            _ => variant,
        }
    }
}

/// Numbers that go with a telegram.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// Own address.
    pub address: u8,
    /// Unit and measuring mode in force.
    pub scale: Scale,
    /// Scan index and telegram index, when the configuration asks for them.
    pub indices: Option<(u8, u8)>,
    /// Quarter degrees by which a partial scan is offset: 0..3.
    pub quarter: u8,
}

/// The telegram for a scan.
#[must_use]
pub fn telegram(output: Output, offer: &Offer, numbers: &Numbers) -> Vec<u8> {
    let words = &offer.words;
    let unit = u16::from(numbers.scale.mm) << 14;
    let count = |count: usize| (u16::try_from(count).unwrap_or(0) | unit).to_le_bytes();
    let mut data = Vec::with_capacity(2 * words.len() + 12);
    let code = match output {
        Output::Mean(n) => {
            data.push(n);
            data.extend(count(words.len()));
            let ranges = range_mask(numbers.scale.mode);
            push(&mut data, words.iter().map(|word| word & ranges));
            0xB6
        }
        Output::SubRange { first, last } => {
            let chosen = words.iter().take(usize::from(last)).skip(usize::from(first.max(1)) - 1);
            data.extend([first.to_le_bytes(), last.to_le_bytes()].concat());
            data.extend(count(chosen.len()));
            push(&mut data, chosen.copied());
            0xB7
        }
        Output::Partial => {
            let turn = one_turn(words, numbers.quarter);
            let flags = 0x2000 | (u16::from(numbers.quarter) << 11);
            data.extend((u16::from_le_bytes(count(turn.len())) | flags).to_le_bytes());
            push(&mut data, turn.into_iter());
            0xB0
        }
        _ => {
            data.extend(count(words.len()));
            push(&mut data, words.iter().copied());
            0xB0
        }
    };
    data.extend(numbers.indices.into_iter().flat_map(|(scan, telegram)| [scan, telegram]));
    reply(numbers.address, code, &data, offer.status)
}

fn push(data: &mut Vec<u8>, words: impl Iterator<Item = u16>) {
    words.for_each(|word| data.extend(word.to_le_bytes()));
}

/// The values of one mirror turn: whole degrees have 181, the turns between them 180. A source has half degrees at best, so the
/// turns at a quarter and three quarters show the half degree before them.
fn one_turn(words: &ScanWords, quarter: u8) -> Vec<u16> {
    let whole_degrees_only = words.len() <= 181;
    let step = if whole_degrees_only { 1 } else { 2 };
    let first = usize::from(quarter >= 2 && !whole_degrees_only);
    let count = if quarter == 0 { 181 } else { 180 };
    words.iter().skip(first).step_by(step).take(count).copied().collect()
}
