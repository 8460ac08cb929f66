//! How people call the devices of a rig, and what the devices say of themselves.

use biplane_recording::Port;
use biplane_wire::lms::Text;

/// How people call the device on a line.
#[must_use]
pub(crate) fn device_name(port: Port) -> &'static str {
    match port {
        Port::Horizontal => "horizontal laser",
        Port::Vertical => "vertical laser",
        Port::Base => "base",
        Port::Imu => "inertial unit",
    }
}

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
