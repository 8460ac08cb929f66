//! Salvages a recording that was cut off or torn: what is intact is copied to a new file, the broken one is
//! only read.
//!
//! * A record that is not whole, or is not what it says, is passed over; the next one that proves itself is
//!   searched for.
//! * Every message of a chunk whose checksum holds is kept.
//! * A chunk that was cut off, or whose bytes were never written (a hole of zeros after a power cut), gives
//!   the messages before the cut.
//! * A whole chunk whose checksum fails gives nothing: which of its messages is damaged cannot be told, and a
//!   damaged message must not pass for a good one.
//! * Channels whose definition was lost are taken from the index at the file's end, if that is left.
//!
//! Whether data was lost can be known only when the file's own end of data is there and all before it is
//! intact. A recording that was cut off may always have lost what was not on the disk yet.

mod finding;
mod hole;
mod report;
mod run;
mod salvage;
mod walk;

pub use finding::{Finding, Problem};
pub use report::{RecoverError, RecoverReport};
pub use run::{recover, recover_over, recover_with};
