//! Errors and warnings of a controller, in words (user manual, "read status"). Firmware of different age
//! answers with two or four bytes, and numbers the bits differently.

use core::fmt;

use crate::WireError;
use crate::cursor::{Reader, Writer};

/// How wide the status is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StatusWidth {
    /// Two bytes: older firmware.
    Narrow,
    /// Four bytes: newer firmware.
    Wide,
}

impl StatusWidth {
    pub(crate) fn bytes(self) -> usize {
        match self {
            StatusWidth::Narrow => 2,
            StatusWidth::Wide => 4,
        }
    }

    fn words(self) -> &'static [&'static str] {
        match self {
            StatusWidth::Narrow => &NARROW,
            StatusWidth::Wide => &WIDE,
        }
    }
}

/// Bit 0 first. The home switches are no trouble and have no word.
const NARROW: [&str; 16] = [
    "over-current warning of motor 1",
    "over-current warning of motor 2",
    "emergency stop",
    "temperature error",
    "temperature 2 error",
    "main battery too high",
    "logic battery too high",
    "logic battery too low",
    "driver fault of motor 1",
    "driver fault of motor 2",
    "main battery high",
    "main battery low",
    "temperature warning",
    "temperature 2 warning",
    "",
    "",
];

/// Bit 0 first. Bits 14 and 15 have no meaning; S4 and S5 are inputs.
const WIDE: [&str; 26] = [
    "emergency stop",
    "temperature error",
    "temperature 2 error",
    "main battery too high",
    "logic battery too high",
    "logic battery too low",
    "driver fault of motor 1",
    "driver fault of motor 2",
    "speed error of motor 1",
    "speed error of motor 2",
    "position error of motor 1",
    "position error of motor 2",
    "current error of motor 1",
    "current error of motor 2",
    "",
    "",
    "over-current warning of motor 1",
    "over-current warning of motor 2",
    "main battery high",
    "main battery low",
    "temperature warning",
    "temperature 2 warning",
    "",
    "",
    "speed limit warning",
    "position limit warning",
];

/// The status as sent. `Display` gives the words, separated by commas; nothing when nothing is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StatusBits {
    /// How many bytes were sent, which also says what the bits mean.
    pub width: StatusWidth,
    /// The bits.
    pub bits: u32,
}

impl StatusBits {
    pub(crate) fn parse(width: StatusWidth, reader: &mut Reader<'_>) -> Result<Self, WireError> {
        let bits = match width {
            StatusWidth::Narrow => u32::from(reader.be_u16()?),
            StatusWidth::Wide => reader.be_u32()?,
        };
        Ok(Self { width, bits })
    }

    pub(crate) fn write(self, writer: &mut Writer<'_>) {
        let bytes = self.bits.to_be_bytes();
        writer.bytes(bytes.get(4 - self.width.bytes()..).unwrap_or_default());
    }

    /// What is wrong, in words.
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        let is_set = move |&(bit, word): &(usize, &&str)| self.bits >> bit & 1 != 0 && !word.is_empty();
        self.width.words().iter().enumerate().filter(is_set).map(|(_, word)| *word)
    }
}

impl fmt::Display for StatusBits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, word) in self.words().enumerate() {
            write!(f, "{}{word}", if index == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{StatusBits, StatusWidth};
    use std::string::ToString;

    #[test]
    fn the_same_trouble_has_other_bits_in_older_firmware() {
        let status = |width, bits| StatusBits { width, bits }.to_string();
        assert_eq!(status(StatusWidth::Wide, 0x0000_0001), "emergency stop");
        assert_eq!(status(StatusWidth::Narrow, 0x0004), "emergency stop");
        assert_eq!(status(StatusWidth::Wide, 0x0008_0020), "logic battery too low, main battery low");
        assert_eq!(status(StatusWidth::Narrow, 0x0880), "logic battery too low, main battery low");
        assert_eq!(status(StatusWidth::Wide, 0x0200_0000), "position limit warning");
    }

    #[test]
    fn switches_and_bits_without_a_meaning_are_no_trouble() {
        assert_eq!(StatusBits { width: StatusWidth::Narrow, bits: 0xC000 }.to_string(), "");
        assert_eq!(StatusBits { width: StatusWidth::Wide, bits: 0xFCC0_C000 }.to_string(), "");
    }
}
