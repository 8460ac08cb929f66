//! MCAP files: records and chunks, reading, writing, recovery.

pub(crate) mod chunk;
pub mod read;
pub(crate) mod records;
pub mod recover;
pub mod write;
