//! Serial lines: the only place that opens ports. Each has a thread that reads and stamps; writes come from the loop.

mod reader;
mod serial;

pub use reader::{Chunk, ChunkBytes, Reader, Shared, spawn};
pub use serial::{Link, open};
