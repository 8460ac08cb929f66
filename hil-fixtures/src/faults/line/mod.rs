//! Faults of the serial line and its adapter.

pub mod bit_noise;
pub mod loose_connector;
pub mod usb_stall;
