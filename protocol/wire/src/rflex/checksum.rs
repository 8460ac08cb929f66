//! The checksum of rFLEX: all bytes from the port to the last data byte, exclusive-or. It misses every pair
//! of equal errors.

/// Exclusive-or of these bytes.
pub fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, &byte| sum ^ byte)
}

#[cfg(test)]
mod tests {
    use super::checksum;

    #[test]
    fn fits_frames_worked_out_by_hand() {
        // Brake off: 02 ^ 00 ^ 0C ^ 00.
        assert_eq!(checksum(&[0x02, 0x00, 0x0C, 0x00]), 0x0E);
        // Odometry on: 02 ^ 22 ^ 08 ^ 01 ^ 86 ^ A0 ^ 03.
        assert_eq!(checksum(&[0x02, 0, 0x22, 0x08, 0, 0x01, 0x86, 0xA0, 0, 0, 0, 3]), 0x0C);
        assert_eq!(checksum(&[]), 0);
    }
}
