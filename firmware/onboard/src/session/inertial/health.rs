//! What a session has seen of an inertial unit.

/// Counts over the whole session.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct InertialHealth {
    /// Intact measurements without count, time, accelerations or turn rates; once the unit has been told what
    /// to send, only many in a row are taken for intact.
    pub incomplete: u64,
    /// Of these, those that came when the unit should have sent all of it, and that nobody keeps.
    pub not_kept: u64,
    /// Messages with a good checksum that were damaged in a way that it does not show: their numbers are none
    /// that a unit sends, their time fits none before and behind it, or one alone is no whole measurement.
    pub rejected: u64,
    /// Measurements that did not arrive, by their count.
    pub missing: u64,
    /// Samples during which a sensor was out of its range.
    pub clipped: u64,
}
