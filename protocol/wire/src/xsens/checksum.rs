//! The checksum of an Xbus message: with it, all bytes behind the preamble add up to 0 modulo 256.

/// What makes the sum of these bytes 0 modulo 256.
pub fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte)).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::checksum;

    #[test]
    fn fits_frames_of_the_documentation() {
        // GoToConfig is FA FF 30 00 D1, GoToMeasurement FA FF 10 00 F1.
        assert_eq!(checksum(&[0xFF, 0x30, 0x00]), 0xD1);
        assert_eq!(checksum(&[0xFF, 0x10, 0x00]), 0xF1);
        assert_eq!(checksum(&[]), 0);
    }
}
