//! Other people's recordings, as unposed recordings of ours.

pub(crate) mod bag;
pub(crate) mod carmen;
mod carmen_line;
mod carmen_messages;
mod log_lines;
mod no_return;
