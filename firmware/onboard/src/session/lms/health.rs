//! What a laser's session has seen of its device, as plain numbers for diagnostics and the account at the
//! end.

use biplane_wire::lms::{Fault, Status};

use crate::session::lms::scan::condition::Troubles;

/// Faults of a device's list that are kept; more are counted only.
pub(crate) const MAX_FAULTS: usize = 8;

/// The state of a laser beside that of its line.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct LaserHealth {
    /// Status byte of the last scan.
    pub status: Option<Status>,
    /// What it has complained of lately.
    pub troubles: Troubles,
    /// Faults that the device had at the last start.
    pub faults: FaultList,
    /// Scans with a polluted window.
    pub polluted_scans: u64,
    /// Scans that the device itself held for implausible.
    pub implausible_scans: u64,
    /// Values whose receiver was dazzled.
    pub dazzled_values: u64,
    /// Telegrams that the device sent and that did not arrive whole, by their index bytes.
    pub lost_telegrams: u64,
    /// Scans that the device measured and did not send because its line was busy, by their index bytes.
    pub left_out_scans: u64,
    /// Telegrams with a good checksum whose form showed that they were damaged.
    pub rejected: u64,
    /// Bytes of telegrams that were taken for damaged until another one of their form came.
    pub confirmed_bytes: u64,
    /// Intact telegrams that could not be published.
    pub not_kept: u64,
    /// Configurations written to the device.
    pub writes: u8,
    /// Whether the device is set otherwise than the rig asks.
    pub differs: bool,
}

/// Faults that a device has told.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct FaultList {
    /// The first of them.
    pub first: [Option<Fault>; MAX_FAULTS],
    /// All of them.
    pub count: u16,
}

impl FaultList {
    /// The list of a device's faults.
    pub(crate) fn of(faults: impl Iterator<Item = Fault>) -> Self {
        let mut list = Self::default();
        for fault in faults {
            if let Some(place) = list.first.get_mut(usize::from(list.count)) {
                *place = Some(fault);
            }
            list.count = list.count.saturating_add(1);
        }
        list
    }
}

impl std::fmt::Display for FaultList {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.count == 0 {
            return f.write_str("no faults");
        }
        for (index, fault) in self.first.iter().flatten().enumerate() {
            let gap = if index == 0 { "" } else { ", " };
            write!(f, "{gap}{fault}")?;
        }
        match usize::from(self.count).saturating_sub(MAX_FAULTS) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}
