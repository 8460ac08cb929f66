//! Scans and odometry as the bytes that devices would have sent: a capture from an import or a recording.
//!
//! The inverse of the onboard time model: a scan's telegram begins k mirror turns after its stamp, an
//! odometry packet at its stamp. A line carries one byte after another: a telegram whose time comes while the
//! line is still busy, because stamps step back or stand too close for the line's rate, follows when the line
//! is free, and is counted as delayed. A line whose stamps crowd it is raised to a faster rate first, unless
//! the rig was given. No scan is left out; an odometry sample is, when the base's line is so far behind that
//! the next one is due. Ranges in whole units of the rig; +inf becomes "no echo" (8191), other values that
//! are no range become "read error" (8186).

mod base;
mod busy_line;
mod fan_laser;
mod laser;
mod options;
mod rates;
mod run;
#[cfg(test)]
mod tests;

pub use options::{EncodeError, EncodeOptions, EncodeReport};
pub use run::run;
