//! Faults by name: of the line, of the power, of the measurement, of the start and of the host's clock.
//!
//! Every preset draws from a seed. Nothing here reads a clock or a port: [`Faults`] fits them around devices,
//! lines and clocks that a caller drives, be it `serve` on pseudo-terminals, `simulate` or a test in
//! simulated time. One file a preset in `faults/`.

pub mod clock_step;
pub mod device;
pub mod episodes;
pub mod line;
mod preset;
mod set;
pub mod unplug;

pub use preset::{ActsOn, Misplaced, Place, Preset, UnknownPreset};
pub use set::{FaultParams, Faults};
