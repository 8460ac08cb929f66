//! ASCII text as devices send it: type and firmware names, padded with blanks, not to be trusted.

use core::fmt;

/// Text inside a telegram. `Display` prints it without padding, and a dot for every byte that is not
/// printable ASCII.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Text<'a>(
    /// The bytes as sent, padding included.
    pub &'a [u8],
);

impl<'a> Text<'a> {
    /// Without blanks and zeros at both ends.
    pub fn trimmed(self) -> &'a [u8] {
        let is_padding = |byte: &u8| *byte == b' ' || *byte == 0;
        let Some(first) = self.0.iter().position(|byte| !is_padding(byte)) else {
            return &[];
        };
        let end = self.0.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1);
        self.0.get(first..end).unwrap_or(&[])
    }

    /// The trimmed text, if it is printable ASCII.
    pub fn as_str(self) -> Option<&'a str> {
        let text = self.trimmed();
        let printable = text.iter().all(|byte| matches!(byte, b' '..=b'~'));
        core::str::from_utf8(text).ok().filter(|_| printable)
    }
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for &byte in self.trimmed() {
            let printable = matches!(byte, b' '..=b'~');
            fmt::Write::write_char(f, if printable { char::from(byte) } else { '.' })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::Text;
    use std::string::ToString;

    #[test]
    fn padding_goes_and_strange_bytes_become_dots() {
        assert_eq!(Text(b"LMS291;S05;X01.27 ").as_str(), Some("LMS291;S05;X01.27"));
        assert_eq!(Text(b"  V02.10 \0").to_string(), "V02.10");
        assert_eq!(Text(b"A\x07\xFFB").as_str(), None);
        assert_eq!(Text(b"A\x07\xFFB").to_string(), "A..B");
        assert_eq!(Text(b"   ").as_str(), Some(""));
    }
}
