//! The LMS checksum (telegram listing, section 4).
//!
//! No catalog CRC: a 16-bit register starts at 0; for every byte it is shifted left once, 8005h is added
//! (xor) when a 1 fell out, and then the word `previous byte, this byte` is added. So the register moves one
//! bit a byte, and each byte enters twice. It finds every single-bit error, but never a flip of bit j of a
//! byte together with bit j + 1 of the next one: length and range checks stay necessary.

const POLYNOMIAL: u16 = 0x8005;

/// Checksum over all bytes of a telegram from STX to the last byte before the checksum. Sent low byte first.
pub fn checksum(bytes: &[u8]) -> u16 {
    let mut register = 0u16;
    let mut previous = 0u16;
    for &byte in bytes {
        let carry = if register & 0x8000 == 0 { 0 } else { POLYNOMIAL };
        register = (register << 1) ^ carry ^ (previous << 8 | u16::from(byte));
        previous = u16::from(byte);
    }
    register
}

#[cfg(test)]
mod tests {
    use super::checksum;
    use crc::{CRC_16_UMTS, Crc};

    /// The same sum by another road. The telegram is a polynomial of words `previous << 8 | this`, one power
    /// of x apart; added up it is `high * x^16 + low`, and a CRC-16 with polynomial 8005h reduces the high
    /// part.
    fn by_catalog_crc(bytes: &[u8]) -> u16 {
        // Bits of the sum, lowest power first.
        let mut powers = [false; 1100];
        let mut previous = 0u8;
        for (index, &byte) in bytes.iter().enumerate() {
            let word = u16::from(previous) << 8 | u16::from(byte);
            for bit in (0..16).filter(|bit| word >> bit & 1 == 1) {
                powers[bytes.len() - 1 - index + bit] ^= true;
            }
            previous = byte;
        }
        let low = (0..16).filter(|&bit| powers[bit]).fold(0u16, |low, bit| low | 1 << bit);
        let mut high = [0u8; 136];
        for power in (16..powers.len()).filter(|&power| powers[power]) {
            let bit = power - 16;
            high[135 - bit / 8] |= 1 << (bit % 8);
        }
        Crc::<u16>::new(&CRC_16_UMTS).checksum(&high) ^ low
    }

    #[test]
    fn equals_crc16_umts_of_the_folded_words_at_every_length() {
        let mut state = 1u32;
        let mut bytes = [0u8; 820];
        for length in 1..=bytes.len() {
            for byte in &mut bytes[..length] {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (state >> 24) as u8;
            }
            assert_eq!(checksum(&bytes[..length]), by_catalog_crc(&bytes[..length]), "length {length}");
        }
    }

    #[test]
    fn fits_the_listing_s_examples() {
        assert_eq!(checksum(&[0x02, 0x00, 0x01, 0x00, 0x31]), 0x1215);
        assert_eq!(checksum(&[0x02, 0x00, 0x02, 0x00, 0x20, 0x24]), 0x0834);
        assert_eq!(checksum(&[]), 0);
    }

    #[test]
    fn finds_every_single_bit_error() {
        let good = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10];
        for bit in 0..good.len() * 8 {
            let mut bad = good;
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(checksum(&bad), checksum(&good), "bit {bit}");
        }
    }
}
