//! Device sessions: state machines that talk to one device each, without any I/O.
//!
//! A session has two doors. [`Session::handle`](device_session::Session::handle) takes one input with the
//! time at which it happened; [`Session::poll`](device_session::Session::poll) is then asked until it answers
//! [`Output::WaitUntil`](device_session::Output::WaitUntil): nothing more before this time or the next bytes.
//! Whoever drives a session (serial port, pseudo-terminal, capture, test) writes the bytes, changes the rate
//! and calls again. Times are nanoseconds on any one line that does not step. Sources: SICK telegram listing
//! 8007954, Pioneer manuals.

pub(crate) mod base;
pub(crate) mod cola;
pub(crate) mod device_session;
pub(crate) mod event;
pub(crate) mod inertial;
pub(crate) mod lms;
pub(crate) mod machine_session;
pub(crate) mod queues;
pub(crate) mod scip;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod timing;
