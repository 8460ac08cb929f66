//! What leaves an engine: messages and states into a sink, commands and events for its driver, the account at
//! the end.

pub(crate) mod health;
pub(crate) mod outbox;
pub(crate) mod publisher;
pub(crate) mod report;
pub(crate) mod sink;
