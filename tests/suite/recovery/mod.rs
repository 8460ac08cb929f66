//! Starting, stopping, restarting and crashing: what is recorded must stay.

pub(crate) mod crash;
pub(crate) mod restarts;
pub(crate) mod start_up;
pub(crate) mod stopping;
