//! What a scanning laser is on the base, and what one of its scans holds: the geometry and timing of beams,
//! and ranges. Meters, radians, nanoseconds.

use nalgebra::Isometry3;

/// One beam of a laser's fan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamGeometry {
    /// Direction in the laser's frame, counter-clockwise from its x axis, radians.
    pub angle_rad: f64,
    /// Time of the beam after the scan's stamp, nanoseconds.
    pub delay_ns: i64,
}

/// The geometry and timing of a scanning laser on the base.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanGeometry {
    /// Pose of the laser in `base_link`.
    pub base_from_laser: Isometry3<f64>,
    /// The beams in the order of a scan's ranges.
    pub beams: Vec<BeamGeometry>,
}

/// One scan: its stamp and a range for every beam of the fan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RangeScan {
    /// Time of the scan's stamp, nanoseconds.
    pub stamp_ns: i64,
    /// Distances, meters; infinite or NaN where nothing was measured.
    pub ranges_m: Vec<f32>,
}

/// Most beams of one scan that get an index. Index 65,535 is left free: files with point numbers use it for
/// "no beam".
pub(crate) const MAX_BEAMS_PER_SCAN: usize = u16::MAX as usize;
