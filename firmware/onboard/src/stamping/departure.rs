//! One telegram of a device that works in cycles, as its clock gets it.

use crate::stamping::arrivals::Pace;

/// One telegram.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Departure {
    /// When its first byte left the device, as its reads allow, nanoseconds.
    pub time_ns: i64,
    /// How its bytes came, and so what that time is worth.
    pub pace: Pace,
    /// Cycles of one scan: distances are multiples of it.
    pub unit: i64,
    /// Cycles since the telegram before when only the line kept them apart.
    pub min_cycles: i64,
    /// Whether it follows the telegram before without a byte between.
    pub is_next: bool,
    /// The device's own count of cycles, modulo 256.
    pub index: Option<u8>,
    /// What is known of the host at that time.
    pub host: HostState,
}

/// Whether the host read in time.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) enum HostState {
    /// It did.
    #[default]
    Listening,
    /// Nobody listened while the telegram came: its reads say nothing, its place in the stream everything.
    Overdue,
    /// It listens again, behind bytes that filled the kernel's buffer: others may be lost, and the place in
    /// the stream says nothing.
    Resumed,
}
