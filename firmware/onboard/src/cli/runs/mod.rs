//! Commands that make recordings: live, from a file, or from the remains of an interrupted run.

pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod salvage;
pub(crate) mod summary;
