//! Faults of the devices and of what they measure.

pub mod dazzle;
pub mod left_streaming;
pub mod power_cycle;
pub mod scan_fault;
pub mod window_dirty;
