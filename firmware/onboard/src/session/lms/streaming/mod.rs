//! Scans flowing, failing to flow, and ended.

pub(crate) mod index_watch;
pub(crate) mod line_times;
pub(crate) mod self_truncated;
pub(crate) mod stop;
pub(crate) mod stream;
