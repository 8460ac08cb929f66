//! What a session has seen of an inertial unit.

/// Counts over the whole session.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct InertialHealth {
    /// Intact measurements without count, time, accelerations or turn rates.
    pub incomplete: u64,
    /// Of these, those that came when the unit should have sent all of it, and that nobody keeps.
    pub not_kept: u64,
    /// Intact measurements whose numbers no unit sends, or whose time fits none before and behind it: they
    /// were damaged in a way that the checksum does not show.
    pub rejected: u64,
    /// Measurements that did not arrive, by their count.
    pub missing: u64,
    /// Samples during which a sensor was out of its range.
    pub clipped: u64,
}
