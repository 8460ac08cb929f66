//! What a mock laser sends: which values, unasked or once.
//!
//! Source: SICK telegram listing, 20h sub-commands and the commands that ask for one scan. Requests whose
//! reply's layout no source tells (20 20..23, 29, 2C, 2E; 30 02, 03; 3E; 76; the parts of 37 at once) are not
//! among them: the device refuses those.

use crate::devices::lms::model::Model;
use crate::devices::lms::settings::Variant;

/// Values from one position to another, counted from 1, both included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// First value.
    pub first: u16,
    /// Last value.
    pub last: u16,
}

impl Span {
    /// From two words, if it lies in a scan.
    fn of(words: &[u8], variant: Variant) -> Option<Self> {
        let &[a, b, c, d] = words else { return None };
        let (first, last) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        let inside = first >= 1 && first <= last && usize::from(last) <= variant.beam_count();
        inside.then_some(Self { first, last })
    }

    /// All values of a scan.
    #[must_use]
    pub fn whole(variant: Variant) -> Self {
        Self { first: 1, last: u16::try_from(variant.beam_count()).unwrap_or(u16::MAX) }
    }

    /// These of a scan's values.
    pub fn of_values<T>(self, values: &[T]) -> &[T] {
        values.get(usize::from(self.first.max(1)) - 1..usize::from(self.last)).unwrap_or_default()
    }
}

/// Up to five parts of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    count: usize,
    spans: [Span; 5],
}

impl Parts {
    /// From the number of parts (word) and their words. Drivers send a word, as the listing's example; its
    /// table says byte.
    fn of(data: &[u8], variant: Variant) -> Option<Self> {
        let &[low, high, ref spans @ ..] = data else { return None };
        let count = usize::from(u16::from_le_bytes([low, high]));
        let mut parts = Self { count, spans: [Span::default(); 5] };
        if spans.len() != 4 * count || !(1..=5).contains(&count) {
            return None;
        }
        for (span, words) in parts.spans.iter_mut().zip(spans.chunks(4)) {
            *span = Span::of(words, variant)?;
        }
        let values: usize = parts.spans().iter().map(|span| usize::from(span.last - span.first) + 1).sum();
        // More than a telegram of this family holds.
        (values <= variant.beam_count()).then_some(parts)
    }

    /// One part: all values.
    #[must_use]
    pub fn whole(variant: Variant) -> Self {
        Self { count: 1, spans: [Span::whole(variant); 5] }
    }

    /// The parts.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        &self.spans[..self.count]
    }
}

/// What a telegram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A whole scan (20 24, 30 01).
    All,
    /// One turn by itself, always over 180 degrees (20 2A, 30 08).
    Partial,
    /// Every n-th value of a scan, from the first on (30 06: 2, 30 07: 20).
    Every(u8),
    /// Mean of n scans (20 26 n, 36 n).
    Mean(u8),
    /// Part of a scan (20 27, 37).
    SubRange(Span),
    /// Part of the mean of n scans (20 28, 3F).
    MeanSubRange {
        /// Scans.
        count: u8,
        /// Part.
        span: Span,
    },
    /// Ranges with remission in parts of a scan (20 2B, 75).
    Pairs(Parts),
    /// All ranges, and the remission of a part (20 50, 44; S14).
    S14(Span),
}

impl Content {
    /// What a sub-command of 20h asks for; `None` when the device does not know it or the arguments are out
    /// of range.
    #[must_use]
    pub fn of_mode(sub: u8, arguments: &[u8], model: Model, variant: Variant) -> Option<Self> {
        match (sub, arguments) {
            (0x24, []) => Some(Self::All),
            (0x26, [n]) => Self::mean(*n),
            (0x27, words) => Span::of(words, variant).map(Self::SubRange),
            // The count is a byte for drivers, a word in the listing's table: the length tells which was
            // meant.
            (0x28, [count, words @ ..] | [count, 0, words @ ..]) if words.len() == 4 => {
                Self::mean_part(*count, words, variant)
            }
            (0x2A, []) if model != Model::S14 => Some(Self::Partial),
            (0x2B, parts) => Parts::of(parts, variant).map(Self::Pairs),
            (0x50, words) if model == Model::S14 => Span::of(words, variant).map(Self::S14),
            _ => None,
        }
    }

    /// What a command asks for once.
    #[must_use]
    pub fn of_request(code: u8, data: &[u8], model: Model, variant: Variant) -> Option<Self> {
        match (code, data) {
            (0x30, [1]) => Some(Self::All),
            (0x30, [6]) => Some(Self::Every(2)),
            (0x30, [7]) => Some(Self::Every(20)),
            (0x30, [8]) if model != Model::S14 => Some(Self::Partial),
            (0x36, [n]) => Self::mean(*n),
            (0x37, words) => Span::of(words, variant).map(Self::SubRange),
            (0x3F, [count, words @ ..]) => Self::mean_part(*count, words, variant),
            (0x44, words) if model == Model::S14 => Span::of(words, variant).map(Self::S14),
            (0x75, parts) => Parts::of(parts, variant).map(Self::Pairs),
            _ => None,
        }
    }

    fn mean(n: u8) -> Option<Self> {
        (2..=250).contains(&n).then_some(Self::Mean(n))
    }

    fn mean_part(count: u8, words: &[u8], variant: Variant) -> Option<Self> {
        let span = Span::of(words, variant)?;
        (2..=250).contains(&count).then_some(Self::MeanSubRange { count, span })
    }

    /// Whole scans as a driver asks for them: alone, or with their remission in the way of the type.
    #[must_use]
    pub fn whole(remission: bool, variant: Variant) -> Self {
        match remission {
            true if variant == Variant::S14 => Self::S14(Span::whole(variant)),
            true => Self::Pairs(Parts::whole(variant)),
            false => Self::All,
        }
    }

    /// Scans that go into one telegram.
    #[must_use]
    pub fn scans(self) -> u8 {
        match self {
            Self::Mean(n) | Self::MeanSubRange { count: n, .. } => n,
            _ => 1,
        }
    }
}

/// What is sent, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Nothing unasked (20 25).
    OnRequest,
    /// One telegram after the other.
    Stream(Content),
    /// One telegram, then what was streamed before.
    Once {
        /// The one.
        content: Content,
        /// What goes on afterwards.
        then: Option<Content>,
    },
}

impl Output {
    /// One telegram now, and afterwards what was sent before.
    #[must_use]
    pub fn once(content: Content, before: Self) -> Self {
        let then = match before {
            Self::Stream(content) => Some(content),
            Self::Once { then, .. } => then,
            Self::OnRequest => None,
        };
        Self::Once { content, then }
    }

    /// What the next telegram holds, if there is one.
    #[must_use]
    pub fn content(self) -> Option<Content> {
        match self {
            Self::OnRequest => None,
            Self::Stream(content) | Self::Once { content, .. } => Some(content),
        }
    }

    /// What goes on after a telegram.
    #[must_use]
    pub fn after_telegram(self) -> Self {
        match self {
            Self::Once { then, .. } => then.map_or(Self::OnRequest, Self::Stream),
            other => other,
        }
    }

    /// Whether scans come without being asked for.
    #[must_use]
    pub fn is_streaming(self) -> bool {
        matches!(self, Self::Stream(_))
    }
}
