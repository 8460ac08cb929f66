//! The onboard process against mock devices on pseudo-terminals: the same serial code as on a robot.

mod in_time;
mod listeners;
mod mock;
mod network;
mod record;
mod recovery;
mod service;
mod stall;
