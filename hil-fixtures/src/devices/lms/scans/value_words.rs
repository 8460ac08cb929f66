//! Value words between units and measuring modes, so that any source can serve any configuration.
//!
//! A word is a range in its low 13, 14, 15 or 16 bits and flags above (SICK telegram listing, configuration
//! block D). The top eight numbers of the range are reserved for codes: no echo, dazzled, overflow, beyond
//! range and so on, the same in cm and mm.

/// How the words of a scan are to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Measuring mode of the configuration: 00..06, 0D, 0E, 0F, 3F.
    pub mode: u8,
    /// Millimeters, else centimeters.
    pub mm: bool,
}

/// Numbers at the top of the range that are codes.
pub const CODES: u16 = 8;

/// Measuring mode whose words are energies instead of ranges.
pub const ENERGY: u8 = 0x3F;

/// The code for "beyond the maximum range", counted down from the top.
pub const BEYOND: u16 = 8;

/// The code for "dazzled", counted down from the top.
pub const DAZZLED: u16 = 1;

/// The code for "signal too small against the noise", counted down from the top.
pub const LOW_SIGNAL: u16 = 4;

/// Bits of a word that are range.
#[must_use]
pub fn range_bits(mode: u8) -> u32 {
    match mode {
        3 | 4 => 14,
        5 | 6 => 15,
        0x0F => 16,
        _ => 13,
    }
}

/// The bits of a word that are range, set.
#[must_use]
pub fn range_mask(mode: u8) -> u16 {
    u16::MAX >> (16 - range_bits(mode))
}

/// The word of a code in a measuring mode. Mode 00 has a flag of its own for dazzle, bit 15.
#[must_use]
pub fn code(mode: u8, below_top: u16) -> u16 {
    let flags = if mode == 0 && below_top == DAZZLED { 0x8000 } else { 0 };
    flags | (range_mask(mode) - below_top)
}

/// The same measurement in another unit and mode. Codes stay codes; a range that no longer fits becomes
/// "beyond range"; flags are kept where the mode is the same and cleared where their meaning would change.
#[must_use]
pub fn recode(word: u16, from: Scale, to: Scale) -> u16 {
    if from == to {
        return word;
    }
    let range = word & range_mask(from.mode);
    let flags = if from.mode == to.mode { word & !range_mask(from.mode) } else { 0 };
    let below_top = range_mask(from.mode) - range;
    let top = range_mask(to.mode);
    if below_top <= CODES {
        return flags | (top - below_top);
    }
    let scaled = match (from.mm, to.mm) {
        (false, true) => u32::from(range) * 10,
        (true, false) => (u32::from(range) + 5) / 10,
        _ => u32::from(range),
    };
    let limit = top - CODES - 1;
    flags | u16::try_from(scaled).ok().filter(|&range| range <= limit).unwrap_or(top - BEYOND)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CM_13: Scale = Scale { mode: 0, mm: false };
    const MM_13: Scale = Scale { mode: 0, mm: true };
    const MM_15: Scale = Scale { mode: 6, mm: true };

    #[test]
    fn words_of_the_same_scale_pass_unchanged_with_their_flags() {
        for word in [0, 0x1234, 0xFFFF, 0xA001] {
            assert_eq!(recode(word, CM_13, CM_13), word);
        }
    }

    #[test]
    fn codes_keep_their_meaning_in_every_mode() {
        assert_eq!(recode(8191, CM_13, MM_15), 32767);
        assert_eq!(recode(8190, CM_13, MM_15), 32766);
        assert_eq!(recode(8183, CM_13, MM_15), 32759);
        assert_eq!(recode(16375, Scale { mode: 3, mm: true }, CM_13), 8183);
    }

    #[test]
    fn a_range_too_far_for_13_bits_of_millimeters_is_beyond_range() {
        assert_eq!(recode(818, CM_13, MM_13), 8180);
        assert_eq!(recode(819, CM_13, MM_13), 8183);
        assert_eq!(recode(3000, CM_13, MM_15), 30_000);
        assert_eq!(recode(4007, MM_15, CM_13), 401);
    }
}
