//! Names and versions that devices tell.

use biplane_wire::lms::Text;

/// A name or a version that a device has told, printable ASCII only.
pub(crate) type ShortText = heapless::String<32>;

pub(crate) fn printable(text: Text<'_>) -> ShortText {
    of_bytes(text.trimmed())
}

/// The same of bytes.
pub(crate) fn of_bytes(text: &[u8]) -> ShortText {
    let mut kept = ShortText::new();
    for &byte in text.iter().take(kept.capacity()) {
        let letter = if matches!(byte, b' '..=b'~') { char::from(byte) } else { '.' };
        if kept.push(letter).is_err() {
            break;
        }
    }
    kept
}
