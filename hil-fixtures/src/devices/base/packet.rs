//! P2OS packets, both ways: FA FB, length, body, checksum (Pioneer 3 manual, client commands and server
//! information packets).
//!
//! Written apart from `biplane-wire`, so that the driver and the device that tests it do not share a mistake.

const HEADER: [u8; 2] = [0xFA, 0xFB];

/// Sum of big-endian words; an odd last byte is xored.
#[must_use]
pub fn checksum(body: &[u8]) -> u16 {
    let mut pairs = body.chunks_exact(2);
    let sum = pairs.by_ref().fold(0u16, |sum, pair| sum.wrapping_add(u16::from_be_bytes([pair[0], pair[1]])));
    pairs.remainder().iter().fold(sum, |sum, &last| sum ^ u16::from(last))
}

/// A whole packet around a body.
#[must_use]
pub fn packet(body: &[u8]) -> Vec<u8> {
    let length = u8::try_from(body.len() + 2).unwrap_or(u8::MAX);
    let mut bytes = vec![HEADER[0], HEADER[1], length];
    bytes.extend_from_slice(body);
    bytes.extend(checksum(body).to_be_bytes());
    bytes
}

/// A client's command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Command number.
    pub number: u8,
    /// Whole-number argument, when there is one.
    pub argument: Option<i32>,
}

/// Reads a body; an argument type without an argument, as Player sends, counts as no argument.
fn command(body: &[u8]) -> Option<Command> {
    let (&number, rest) = body.split_first()?;
    let argument = match *rest {
        [0x3B, low, high] => Some(i32::from(u16::from_le_bytes([low, high]))),
        [0x1B, low, high] => Some(-i32::from(u16::from_le_bytes([low, high]))),
        _ => None,
    };
    Some(Command { number, argument })
}

/// Collects the bytes of one packet at a time.
#[derive(Debug, Default)]
pub struct PacketParser {
    frame: Vec<u8>,
    /// Bytes that belonged to no packet.
    pub dropped_bytes: u64,
    /// Packets with a wrong checksum.
    pub bad_checksums: u64,
}

impl PacketParser {
    /// Gives up what has been heard so far.
    pub fn forget(&mut self) {
        self.dropped_bytes += self.frame.len() as u64;
        self.frame.clear();
    }

    /// Takes one byte; a command when it was the last of a good packet.
    pub fn hear(&mut self, byte: u8) -> Option<Command> {
        match self.frame.len() {
            0 | 1 if byte != HEADER[self.frame.len()] => {
                self.forget();
                self.dropped_bytes += 1;
                return None;
            }
            2 if byte < 3 => {
                self.forget();
                self.dropped_bytes += 1;
                return None;
            }
            _ => self.frame.push(byte),
        }
        let [_, _, length, ref rest @ ..] = self.frame[..] else { return None };
        if rest.len() < usize::from(length) {
            return None;
        }
        let (body, sum) = rest.split_at(usize::from(length) - 2);
        let received = (checksum(body).to_be_bytes() == sum).then(|| command(body)).flatten();
        if received.is_some() {
            self.frame.clear();
        } else {
            self.bad_checksums += 1;
            self.forget();
        }
        received
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hear(bytes: &[u8]) -> (Vec<Command>, PacketParser) {
        let mut parser = PacketParser::default();
        let commands = bytes.iter().filter_map(|&byte| parser.hear(byte)).collect();
        (commands, parser)
    }

    #[test]
    fn a_modem_string_before_the_first_packet_is_skipped() {
        let (commands, parser) = hear(b"WMS2\r\xFA\xFB\x03\x00\x00\x00");
        assert_eq!(commands, [Command { number: 0, argument: None }]);
        assert_eq!(parser.dropped_bytes, 5);
    }

    #[test]
    fn arguments_are_read_with_their_sign_and_may_be_missing_behind_their_type() {
        let bytes = [0xFA, 0xFB, 6, 0x0B, 0x1B, 0xC8, 0, 0xD3, 0x1B, 0xFA, 0xFB, 4, 7, 0x3B, 7, 0x3B];
        let (commands, _) = hear(&bytes);
        assert_eq!(commands[0], Command { number: 11, argument: Some(-200) });
        assert_eq!(commands[1], Command { number: 7, argument: None });
    }

    #[test]
    fn an_odd_last_byte_is_xored() {
        assert_eq!(packet(&[0x07]), [0xFA, 0xFB, 3, 7, 0, 7]);
        assert_eq!(packet(&[0x00, 0xFF, 0xFF])[6..], [0x00, 0x00]);
        assert_eq!(packet(&[0x05, 0x1B, 0x2C, 0x01]), [0xFA, 0xFB, 6, 5, 0x1B, 0x2C, 1, 0x31, 0x1C]);
    }
}
