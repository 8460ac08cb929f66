//! A scan with its time, as the engine hands it on: fixed size, so that the acquisition path allocates
//! nothing.

use biplane_recording::messages::LaserScan;
use biplane_recording::rig;
use biplane_wire::lms::MIRROR_TURN_NS;

use crate::session::cola::scan::{ColaScan, MAX_COLA_BEAMS};
use crate::session::lms::scan::ranges::ScanReading;
use crate::session::scip::scan::ScipScan;

/// Most beams that the matcher gets of a scan; of a longer one, every second, third ... beam.
pub(crate) const MAX_BEAMS: usize = MAX_COLA_BEAMS;
/// Shortest range that is one, meters: one step of a laser in centimeters.
const RANGE_MIN_M: f32 = 0.01;

/// A scan: directions in the laser's own frame, ranges in meters, times of its beams.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct ScanData {
    /// When the first beam was taken, nanoseconds.
    pub stamp_ns: i64,
    /// Direction of the first beam, radians, counter-clockwise from the middle.
    pub angle_min_rad: f64,
    /// From beam to beam, radians.
    pub angle_increment_rad: f64,
    /// Mirror turns of the scan: beam i belongs to turn `i % turns`.
    pub turns: u8,
    /// From a beam to the next of the same turn, divided by the turns, seconds.
    pub time_increment_s: f64,
    /// All turns of the scan, seconds.
    pub scan_time_s: f64,
    /// Shortest valid range, meters.
    pub range_min_m: f32,
    /// Longest valid range, meters.
    pub range_max_m: f32,
    /// A range a beam: meters, `+inf` for nothing in range, NaN for invalid.
    pub ranges_m: heapless::Vec<f32, MAX_BEAMS>,
}

impl ScanData {
    /// A scan from a device, with the time of its first beam.
    #[must_use]
    pub(crate) fn of_reading(reading: &ScanReading, stamp_ns: i64) -> Self {
        let geometry = reading.geometry;
        let step_deg = f64::from(geometry.step_cdeg) / 100.0;
        let turn_s = MIRROR_TURN_NS as f64 * 1e-9;
        Self {
            stamp_ns,
            angle_min_rad: (f64::from(geometry.first_cdeg) / 100.0).to_radians(),
            angle_increment_rad: step_deg.to_radians(),
            turns: geometry.turns,
            time_increment_s: step_deg / 360.0 * turn_s,
            scan_time_s: f64::from(geometry.turns) * turn_s,
            range_min_m: RANGE_MIN_M,
            range_max_m: reading.range_max_m,
            ranges_m: heapless::Vec::from_slice(&reading.ranges_m).unwrap_or_default(),
        }
    }

    /// A scan of a laser on a network, with the time of its first beam.
    #[must_use]
    pub(crate) fn of_cola(scan: &ColaScan, stamp_ns: i64) -> Self {
        Self {
            stamp_ns,
            angle_min_rad: scan.first_deg.to_radians(),
            angle_increment_rad: scan.step_deg.to_radians(),
            turns: 1,
            time_increment_s: scan.step_deg / 360.0 / scan.rate_hz,
            scan_time_s: 1.0 / scan.rate_hz,
            range_min_m: RANGE_MIN_M,
            range_max_m: scan.range_max_m,
            ranges_m: scan.ranges_m.clone(),
        }
    }

    /// A scan of a Hokuyo laser, with the time of its first beam.
    #[must_use]
    pub(crate) fn of_scip(scan: &ScipScan, stamp_ns: i64) -> Self {
        let [range_min_m, range_max_m] = scan.range_m;
        Self {
            stamp_ns,
            angle_min_rad: scan.first_deg.to_radians(),
            angle_increment_rad: scan.step_deg.to_radians(),
            turns: 1,
            time_increment_s: scan.beam_s,
            scan_time_s: scan.scan_s,
            range_min_m,
            range_max_m,
            ranges_m: scan.ranges_m.clone(),
        }
    }

    /// A scan of another recording. Its beams are interlaced when it is one of the rig's laser: same number
    /// of beams, same time from beam to beam.
    #[must_use]
    pub(crate) fn of_message(scan: &LaserScan, laser: Option<&rig::Laser>) -> Self {
        let stride = scan.ranges_m.len().div_ceil(MAX_BEAMS).max(1);
        let increment_s = f64::from(scan.time_increment_s);
        let is_interlaced = |laser: &&rig::Laser| {
            stride == 1
                && laser.beam_count() == scan.ranges_m.len()
                && (laser.time_increment_s() - increment_s).abs() < 1e-7
        };
        let turns = laser.filter(is_interlaced).map_or(1, |laser| laser.turns() as u8);
        Self {
            stamp_ns: scan.stamp_ns,
            angle_min_rad: f64::from(scan.angle_min_rad),
            angle_increment_rad: f64::from(scan.angle_increment_rad) * stride as f64,
            turns,
            time_increment_s: increment_s * stride as f64,
            scan_time_s: f64::from(scan.scan_time_s),
            range_min_m: scan.range_min_m,
            range_max_m: scan.range_max_m,
            ranges_m: scan.ranges_m.iter().step_by(stride).copied().collect(),
        }
    }

    /// When a beam was taken, seconds after the stamp (`docs/time.md`).
    #[must_use]
    pub(crate) fn beam_delay_s(&self, beam: usize) -> f64 {
        let turn_s = MIRROR_TURN_NS as f64 * 1e-9;
        let turn = beam % usize::from(self.turns.max(1));
        turn as f64 * turn_s + beam as f64 * self.time_increment_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::Rig;

    #[test]
    fn beam_times_of_an_interlaced_scan_are_those_of_the_rig() {
        let laser = rig::Laser { resolution_deg: 0.5, ..Rig::default().horizontal };
        let message = LaserScan {
            time_increment_s: laser.time_increment_s() as f32,
            ranges_m: vec![1.0; 361],
            ..LaserScan::default()
        };
        let data = ScanData::of_message(&message, Some(&laser));
        assert_eq!(data.turns, 2);
        for beam in [0, 1, 2, 3, 360] {
            assert!((data.beam_delay_s(beam) - laser.beam_delay_ns(beam) as f64 * 1e-9).abs() < 1e-8);
        }
    }

    #[test]
    fn a_scan_of_another_laser_is_not_interlaced_and_a_long_one_is_thinned() {
        let message = LaserScan {
            angle_min_rad: -2.0,
            angle_increment_rad: 0.001,
            time_increment_s: 1e-5,
            ranges_m: (0..3000).map(|i| i as f32).collect(),
            ..LaserScan::default()
        };
        let data = ScanData::of_message(&message, Some(&Rig::default().horizontal));
        assert_eq!((data.turns, data.ranges_m.len(), data.ranges_m[1]), (1, 1000, 3.0));
        assert!(
            (data.angle_increment_rad - 0.003).abs() < 1e-9 && (data.beam_delay_s(10) - 3e-4).abs() < 1e-9
        );
    }
}
