//! The P2OS checksum: a sum of big-endian words; an odd last byte is xored in, not added (Pioneer 3 manual,
//! "packet checksum"; some drivers get the odd byte wrong and accept almost anything).

/// Checksum over the body of a packet. Sent high byte first.
pub fn checksum(body: &[u8]) -> u16 {
    let (words, odd) = body.as_chunks::<2>();
    let sum = words.iter().fold(0u16, |sum, &word| sum.wrapping_add(u16::from_be_bytes(word)));
    sum ^ odd.first().map_or(0, |&byte| u16::from(byte))
}

#[cfg(test)]
mod tests {
    use super::checksum;

    #[test]
    fn fits_packets_seen_on_the_wire() {
        assert_eq!(checksum(&[0x00]), 0x0000); // SYNC0
        assert_eq!(checksum(&[0x04, 0x3B, 0x01, 0x00]), 0x053B); // ENABLE 1
        assert_eq!(checksum(&[0x0B, 0x1B, 0xC8, 0x00]), 0xD31B); // VEL -200
        assert_eq!(checksum(&[0x07, 0x3B, 0x07]), 0x073C); // odd byte: xor, so 3B ^ 07
    }

    #[test]
    fn the_sum_wraps_at_65536() {
        assert_eq!(checksum(&[0xFF, 0xFF, 0x00, 0x02]), 0x0001);
    }
}
