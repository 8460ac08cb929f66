//! What commands share at the terminal: progress, threads, dry runs, replacing old results.

pub(crate) mod bad_argument;
pub(crate) mod console;
pub(crate) mod dry_run;
pub(crate) mod heartbeat;
pub(crate) mod json;
pub(crate) mod needs;
pub(crate) mod replace;
pub(crate) mod stages;
pub(crate) mod stopwatch;
pub(crate) mod threads;
pub(crate) mod values;
