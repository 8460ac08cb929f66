//! What a mock device measures, behind two traits: the device knows its protocol, the source knows the world.
//!
//! Times are nanoseconds since one time zero that all devices of a rig share. Values are the words of the
//! wire (SICK LMS telegram listing, B0 reply, measuring mode 00: 13 bits of range), so that a capture's scans
//! pass through unchanged.

/// The most values that a scan can hold: 100 degrees in steps of a quarter degree.
pub const MAX_SCAN_VALUES: usize = 401;

/// Value words of one scan, first beam (rightmost) first.
pub type ScanWords = heapless::Vec<u16, MAX_SCAN_VALUES>;

/// Gives a mock laser its scans.
pub trait ScanSource: Send {
    /// Value words of the scan whose first beam is at `t0_ns`.
    ///
    /// `fov_deg` is 100 or 180 (90 on an S14), `resolution_cdeg` the step in hundredths of a degree (100, 50
    /// or 25), `mm` the unit of the values (else centimeters). `None` when this variant cannot be had from
    /// the source, or when it has ended.
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords>;

    /// Value words of one mirror turn over 180 degrees that begins at `t0_ns`, its beams `quarter` quarters
    /// of a degree behind the whole ones: 181 of them at 0, else 180. `None` when the source has no single
    /// turns.
    fn turn(&mut self, t0_ns: i64, quarter: u8, mm: bool) -> Option<ScanWords> {
        let _ = (t0_ns, quarter, mm);
        None
    }
}

/// What a base has counted: in the units of a P2OS packet, and as way and turn for bases that report counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OdometrySample {
    /// Position along the base's own x axis in ticks, 15 bits, wrapping.
    pub x_raw: u16,
    /// Position along the base's own y axis in ticks, 15 bits, wrapping.
    pub y_raw: u16,
    /// Heading, 4096 a turn, counter-clockwise, in -2048..2048.
    pub theta_raw: i16,
    /// Speed of the left wheel, mm/s.
    pub left_mm_s: i16,
    /// Speed of the right wheel, mm/s.
    pub right_mm_s: i16,
    /// Whether the motors turn.
    pub moving: bool,
    /// Way driven since the start, micrometers, forward positive.
    pub path_um: i64,
    /// Turned since the start, microradians, counter-clockwise, not wrapped.
    pub heading_urad: i64,
}

/// Gives a mock base its odometry.
pub trait OdometrySource: Send {
    /// The odometry at `t_ns`. Later samples are asked with times that do not step back.
    fn sample(&mut self, t_ns: i64) -> OdometrySample;
}
