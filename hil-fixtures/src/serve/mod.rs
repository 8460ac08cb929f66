//! A mock rig on pseudo-terminals, or on TCP ports of this machine: two lasers and a base that answer their
//! protocols and then stream a world or a capture.
//!
//! Each device runs on a thread of its own, on a virtual clock that is the wall clock times `speed`. A link
//! in the chosen folder appears when its device is ready and is removed when the mock ends.

mod ahead;
mod ahead_fan;
mod client_rate;
mod clock;
mod devices;
mod lock;
mod network_port;
mod options;
mod port;
mod serving;
mod truth;

pub use options::{LinkName, ServeError, ServeOptions, Source};
pub use port::PortReport;
pub use serving::{ServeReport, serve};
