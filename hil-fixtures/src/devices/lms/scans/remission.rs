//! How strongly a surface throws the light back, as a mock laser reports it.
//!
//! The worlds here have no reflectivity. The remission falls with the range alone, 13000 / (1 + range / 1 m),
//! so that it can be told from a range and checked by hand: 6500 at 1 m, 3250 at 3 m. The largest values are
//! those of real devices (0 to about 13000 in a word, a whole byte on an S14).

use crate::devices::lms::scans::value_words::{CODES, Scale, range_mask};

/// Remission of a value word: 0 where there is no range.
#[must_use]
pub fn of_word(word: u16, scale: Scale) -> u16 {
    let range = word & range_mask(scale.mode);
    if range_mask(scale.mode) - range <= CODES {
        return 0;
    }
    let range_mm = u32::from(range) * if scale.mm { 1 } else { 10 };
    u16::try_from(13_000_000 / (1000 + range_mm)).unwrap_or(0)
}

/// The same as a byte.
#[must_use]
pub fn byte_of_word(word: u16, scale: Scale) -> u8 {
    u8::try_from(u32::from(of_word(word, scale)) * 255 / 13_000).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remission_falls_with_the_range_and_is_nothing_without_one() {
        let (cm, mm) = (Scale { mode: 0, mm: false }, Scale { mode: 6, mm: true });
        assert_eq!([0, 100, 300, 1200, 8191, 8183].map(|w| of_word(w, cm)), [13_000, 6500, 3250, 1000, 0, 0]);
        assert_eq!([1000, 3000, 32_767].map(|w| of_word(w, mm)), [6500, 3250, 0]);
        assert_eq!([0, 100, 300].map(|w| byte_of_word(w, cm)), [255, 127, 63]);
    }
}
