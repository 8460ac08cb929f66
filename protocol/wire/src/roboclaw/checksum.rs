//! CRC-16/XMODEM, sent high byte first: over a whole request, or over a question's address and command and
//! its answer.

use crc::{CRC_16_XMODEM, Crc};

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// The CRC over these parts, one behind the other.
pub fn checksum(parts: &[&[u8]]) -> u16 {
    let mut digest = CRC.digest();
    for part in parts {
        digest.update(part);
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::checksum;

    /// The manual's own loop, bit by bit: polynomial 1021h, from 0.
    fn by_bits(bytes: &[u8]) -> u16 {
        let mut crc = 0_u16;
        for &byte in bytes {
            crc ^= u16::from(byte) << 8;
            for _ in 0..8 {
                crc = if crc & 0x8000 != 0 { (crc << 1) ^ 0x1021 } else { crc << 1 };
            }
        }
        crc
    }

    #[test]
    fn is_the_manuals_loop_and_the_catalogs_check_value() {
        assert_eq!(checksum(&[b"123456789"]), 0x31C3);
        assert_eq!(checksum(&[&[0x80], &[78, 0, 1], &[2]]), by_bits(&[0x80, 78, 0, 1, 2]));
        assert_eq!(checksum(&[]), 0);
    }
}
