//! Numbers as text: groups of six bits, the high one first, each a character from `0` to `o`; and the sum of
//! a line.

/// The character of six bits that are 0.
const ZERO: u8 = 0x30;
const SIX_BITS: u32 = 0x3F;

/// The character behind a line's bytes.
#[must_use]
pub fn sum(bytes: &[u8]) -> u8 {
    let sum = bytes.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte));
    (sum & SIX_BITS as u8) + ZERO
}

/// Six bits of a character; `None` for one that is no number.
pub(crate) fn six_bits(character: u8) -> Option<u32> {
    let bits = u32::from(character.wrapping_sub(ZERO));
    (bits <= SIX_BITS).then_some(bits)
}

/// The number of characters.
pub(crate) fn decode(characters: &[u8]) -> Option<u32> {
    characters.iter().try_fold(0_u32, |number, &character| Some(number << 6 | six_bits(character)?))
}

/// The characters of a number's lowest bits.
pub(crate) fn encode<const N: usize>(number: u32) -> [u8; N] {
    let mut rest = number;
    let mut characters = [ZERO; N];
    for character in characters.iter_mut().rev() {
        *character = (rest & SIX_BITS) as u8 + ZERO;
        rest >>= 6;
    }
    characters
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_sums_are_those_of_the_paper() {
        for (text, number) in [
            (&b"CB"[..], 1234),
            (b"1Dh", 5432),
            (b"m2@0", 16_000_000),
            (b"000", 0),
            (b"00C", 19),
            (b">YP", 60_000),
            (b"?om", 65_533),
            (b"7D`", 30_000),
            (b"oooo", 16_777_215),
        ] {
            assert_eq!(decode(text), Some(number));
        }
        assert_eq!((encode(1234), encode(5432), encode(16_000_000)), (*b"CB", *b"1Dh", *b"m2@0"));
        assert_eq!((decode(b"0p"), decode(b"/0"), sum(b"Hokuyo")), (None, None, b'o'));
        for line in [b"00P", b"01Q", b"10Q", b"98a", b"99b", b"0Aa", b"0Ll"] {
            assert_eq!(sum(&line[..2]), line[2]);
        }
    }
}
