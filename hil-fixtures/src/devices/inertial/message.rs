//! The frame of a mock unit's messages, both ways.

/// A whole message.
#[must_use]
pub fn message(mid: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0xFA, 0xFF, mid];
    match u8::try_from(data.len()) {
        Ok(length) if length < 0xFF => bytes.push(length),
        _ => {
            bytes.push(0xFF);
            bytes.extend((data.len().min(2048) as u16).to_be_bytes());
        }
    }
    bytes.extend(data.iter().take(2048));
    bytes.push(sum_to_zero(&bytes[1..]));
    bytes
}

fn sum_to_zero(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0_u8, |rest, byte| rest.wrapping_sub(*byte))
}

/// Cuts commands out of what a unit hears. Hosts send no long ones: a length of `FF` is noise.
#[derive(Clone, Debug, Default)]
pub struct MessageParser {
    received: Vec<u8>,
    /// Bytes that belonged to no command.
    pub dropped_bytes: u64,
    /// Commands with a wrong checksum.
    pub bad_checksums: u64,
}

impl MessageParser {
    /// Takes a byte; the identifier and the data of the command that it ends.
    pub fn hear(&mut self, byte: u8) -> Option<(u8, Vec<u8>)> {
        self.received.push(byte);
        match self.received[..] {
            [0xFA] | [0xFA, 0xFF] | [0xFA, 0xFF, _] => None,
            [0xFA, 0xFF, mid, length, ref rest @ ..] if length < 0xFF => {
                let data = rest.strip_suffix(&[byte]).unwrap_or_default().to_vec();
                if rest.len() <= usize::from(length) {
                    return None;
                }
                let is_good = sum_to_zero(&self.received[1..]) == 0;
                self.bad_checksums += u64::from(!is_good);
                self.received.clear();
                is_good.then_some((mid, data))
            }
            _ => {
                self.forget();
                None
            }
        }
    }

    /// What has come of a command has no rest.
    pub fn forget(&mut self) {
        self.dropped_bytes += self.received.len() as u64;
        self.received.clear();
    }
}
