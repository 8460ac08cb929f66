//! The frame that every telegram shares: its fixed bytes, its checksum, and putting it around a body.

mod checksum;
mod emit;
mod layout;

pub use checksum::checksum;
pub(crate) use emit::{emit, framed_len};
pub use layout::{ACK, BROADCAST, MIRROR_TURN_NS, NAK, PASSWORD, REPLY_ADDRESS, REPLY_BIT, STX};
pub(crate) use layout::{DATA_OFFSET, FRAME_OVERHEAD};
