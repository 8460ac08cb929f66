//! The telegrams that carry scans: B0, B6, B7, BF, C4, F5 (SICK telegram listing 8007954, sections 7.6, 7.29,
//! 7.37).

use super::feed::Offer;
use super::remission;
use super::stream::{Content, Parts, Span};
use crate::devices::lms::frame::reply;
use crate::devices::lms::scans::value_words::{ENERGY, Scale, range_mask};

/// Numbers that go with a telegram.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// Own address.
    pub address: u8,
    /// Unit and measuring mode in force.
    pub scale: Scale,
    /// Scan index and telegram index, when the configuration asks for them.
    pub indices: Option<(u8, u8)>,
    /// Quarter degrees by which a single turn is offset: 0..3.
    pub quarter: u8,
    /// Status byte.
    pub status: u8,
}

/// The telegram for a scan, a mean or a turn, as the content needs it.
#[must_use]
pub fn telegram(content: Content, offer: &Offer, numbers: &Numbers) -> Vec<u8> {
    let scale = numbers.scale;
    let words: Vec<u16> = match scale.mode {
        // Energy values instead of ranges.
        ENERGY => offer.words.iter().map(|word| remission::of_word(*word, scale)).collect(),
        _ => offer.words.to_vec(),
    };
    let mut data = Vec::with_capacity(4 * words.len() + 24);
    let code = match content {
        Content::All => values(&mut data, &words, scale, 0xB0),
        Content::Every(n) => {
            let thinned: Vec<u16> = words.iter().step_by(usize::from(n.max(1))).copied().collect();
            values(&mut data, &thinned, scale, 0xB0)
        }
        Content::Partial => {
            let flags = 0x2000 | (u16::from(numbers.quarter & 3) << 11);
            data.extend((count_word(words.len(), scale) | flags).to_le_bytes());
            push(&mut data, &words);
            0xB0
        }
        Content::Mean(n) => {
            data.push(n);
            values(&mut data, &without_flags(&words, scale), scale, 0xB6)
        }
        Content::SubRange(span) => {
            push(&mut data, &[span.first, span.last]);
            values(&mut data, span.of_values(&words), scale, 0xB7)
        }
        Content::MeanSubRange { count, span } => {
            data.push(count);
            push(&mut data, &[span.first, span.last]);
            values(&mut data, span.of_values(&without_flags(&words, scale)), scale, 0xBF)
        }
        Content::Pairs(parts) => pairs(&mut data, &words, &parts, scale),
        Content::S14(span) => with_remission_bytes(&mut data, &words, span, scale),
    };
    data.extend(numbers.indices.into_iter().flat_map(|(scan, telegram)| [scan, telegram]));
    reply(numbers.address, code, &data, numbers.status)
}

fn count_word(count: usize, scale: Scale) -> u16 {
    u16::try_from(count).unwrap_or(0) | u16::from(scale.mm) << 14
}

fn push(data: &mut Vec<u8>, words: &[u16]) {
    words.iter().for_each(|word| data.extend(word.to_le_bytes()));
}

/// Count word and values.
fn values(data: &mut Vec<u8>, words: &[u16], scale: Scale, code: u8) -> u8 {
    push(data, &[count_word(words.len(), scale)]);
    push(data, words);
    code
}

fn without_flags(words: &[u16], scale: Scale) -> Vec<u16> {
    if scale.mode == ENERGY {
        return words.to_vec();
    }
    words.iter().map(|word| word & range_mask(scale.mode)).collect()
}

/// F5: number of parts, then of each its positions, count word, and pairs of range and remission.
fn pairs(data: &mut Vec<u8>, words: &[u16], parts: &Parts, scale: Scale) -> u8 {
    push(data, &[u16::try_from(parts.spans().len()).unwrap_or(0)]);
    for span in parts.spans() {
        let chosen = span.of_values(words);
        push(data, &[span.first, span.last, count_word(chosen.len(), scale)]);
        chosen.iter().for_each(|&word| push(data, &[word, remission::of_word(word, scale)]));
    }
    0xF5
}

/// C4: count word and all ranges, then number, first and last of the remissions and a byte for each.
fn with_remission_bytes(data: &mut Vec<u8>, words: &[u16], span: Span, scale: Scale) -> u8 {
    values(data, words, scale, 0xC4);
    let chosen = span.of_values(words);
    push(data, &[u16::try_from(chosen.len()).unwrap_or(0), span.first, span.last]);
    data.extend(chosen.iter().map(|&word| remission::byte_of_word(word, scale)));
    0xC4
}
