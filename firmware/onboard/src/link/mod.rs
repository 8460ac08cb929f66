//! Serial lines: the only place that opens ports. Each has a thread that reads and stamps; writes come from the loop.

mod adapter;
mod place;
mod reader;
mod refusal;
mod serial;
mod tty;

pub use place::{Place, SERIAL_LINKS};
pub use reader::{Chunk, ChunkBytes, News, Reader, Shared, spawn};
pub use refusal::reason;
pub use serial::Link;
pub use tty::Tty;
