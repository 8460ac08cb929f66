//! Commands that measure the matcher.

pub(crate) mod basin;
pub(crate) mod bench;
pub(crate) mod parameters;
