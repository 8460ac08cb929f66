//! Cutting a byte stream into frames.
//!
//! A serial line delivers bytes in any chunks, with noise, gaps and damage. A [`Deframer`] keeps a bounded
//! buffer and hands out every byte exactly once (those of a frame that is taken back, again): inside a frame,
//! as a control byte between frames, or as skipped. So `frame_bytes + control_bytes + skipped_bytes = bytes
//! in`, however the stream was cut up.
//!
//! Neither protocol stuffs bytes: the start sequence may occur in data. A frame is recognized by its length
//! *and* checksum alone; when that fails, the search goes on at the failed frame's second byte, not behind
//! its end, because its length may be the damaged part.

mod deframer;
mod item;
mod protocol;

pub use deframer::Deframer;
pub use item::{Counts, Item, SkipReason};
pub use protocol::{Framing, Measure};
