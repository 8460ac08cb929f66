//! The recorder of a live run: a bounded queue, and the thread that writes the file behind it.

pub(crate) mod delays;
pub(crate) mod disk;
pub(crate) mod queue;
pub(crate) mod writer;
