//! Telegrams as a mock laser sends them: STX, address + 80h, length, code, data, status byte, checksum (SICK
//! telegram listing 3.1).
//!
//! Written apart from `biplane-wire`, so that the driver and the device that tests it do not share a mistake.

/// A good request was received.
pub const ACK: u8 = 0x06;
/// A request came with a wrong checksum.
pub const NAK: u8 = 0x15;

const STX: u8 = 0x02;
const GENERATOR: u16 = 0x8005;

/// SICK's checksum: the register moves one bit a byte and takes in each byte with the one before it.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u16 {
    let mut register: u16 = 0;
    let mut previous: u8 = 0;
    for &byte in bytes {
        let carry = register & 0x8000 != 0;
        register <<= 1;
        if carry {
            register ^= GENERATOR;
        }
        register ^= u16::from_be_bytes([previous, byte]);
        previous = byte;
    }
    register
}

/// A whole reply telegram from its code and data.
#[must_use]
pub fn reply(address: u8, code: u8, data: &[u8], status: u8) -> Vec<u8> {
    let length = u16::try_from(data.len() + 2).unwrap_or(u16::MAX).to_le_bytes();
    let mut telegram = vec![STX, address | 0x80, length[0], length[1], code];
    telegram.extend_from_slice(data);
    telegram.push(status);
    let sum = checksum(&telegram).to_le_bytes();
    telegram.extend_from_slice(&sum);
    telegram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_of_the_telegram_listing_come_out_byte_for_byte() {
        assert_eq!(reply(0, 0xA0, &[0], 0x10), [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A]);
        assert_eq!(reply(0, 0x92, &[], 0x10), [0x02, 0x80, 0x02, 0x00, 0x92, 0x10, 0x7F, 0x33]);
        let variant = [0x02, 0x80, 0x07, 0x00, 0xBB, 0x01, 0xB4, 0x00, 0x32, 0x00, 0x10, 0x03, 0x9D];
        assert_eq!(reply(0, 0xBB, &[1, 0xB4, 0, 0x32, 0], 0x10), variant);
    }

    #[test]
    fn the_checksum_of_install_mode_is_that_of_the_listing() {
        let telegram = [0x02, 0, 0x0A, 0, 0x20, 0, 0x53, 0x49, 0x43, 0x4B, 0x5F, 0x4C, 0x4D, 0x53];
        assert_eq!(checksum(&telegram).to_le_bytes(), [0xBE, 0xC5]);
    }
}
