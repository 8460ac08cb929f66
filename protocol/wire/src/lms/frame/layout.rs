//! The fixed bytes and offsets that every telegram shares (telegram listing, section 4).

/// First byte of every telegram.
pub const STX: u8 = 0x02;
/// Acknowledge: the request was understood.
pub const ACK: u8 = 0x06;
/// Refusal: the request was damaged; wait at least 30 ms and send it again.
pub const NAK: u8 = 0x15;
/// Address of a request to any device.
pub const BROADCAST: u8 = 0x00;
/// Address of a reply from a device that has no address of its own.
pub const REPLY_ADDRESS: u8 = 0x80;
/// Set in the address of every reply, and in its code.
pub const REPLY_BIT: u8 = 0x80;
/// Everything of a telegram that its length field does not count: start, address, length, checksum.
pub(crate) const FRAME_OVERHEAD: usize = 6;
/// Where the data of a telegram start.
pub(crate) const DATA_OFFSET: usize = 5;
/// One turn of the mirror (75 Hz), in nanoseconds.
pub const MIRROR_TURN_NS: i64 = 13_320_000;
/// Password of the installation mode as delivered.
pub const PASSWORD: [u8; 8] = *b"SICK_LMS";
