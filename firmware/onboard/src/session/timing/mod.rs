//! How long a session waits: for an answer, and for a line that brings nothing.

pub(crate) mod line_watch;
pub(crate) mod retry;
pub(crate) mod silence;
