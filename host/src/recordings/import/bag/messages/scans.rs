//! A scan of a bag as our recordings have it: what is measured stays to the bit, what is none becomes
//! infinite or NaN.

use biplane_recording::messages::LaserScan;

/// Shortest and longest range where a bag tells none, in m.
const RANGES_M: [f32; 2] = [0.02, 100.0];
/// So near to the longest range, in m, a range is that limit itself, which drivers write for "nothing seen".
const LIMIT_M: f32 = 1e-3;

/// Times of a laser's beams.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct BeamTimes {
    /// From a beam to the next, in s.
    pub time_increment_s: f32,
    /// From a scan to the next, in s.
    pub scan_time_s: f32,
}

/// Whether a scan can be used: beams in directions that are numbers, and not all in one.
pub(crate) fn is_usable(scan: &LaserScan) -> bool {
    let increment = scan.angle_increment_rad;
    !scan.ranges_m.is_empty() && scan.angle_min_rad.is_finite() && increment.is_finite() && increment != 0.0
}

/// The time from a beam to the next that a scan tells, if it tells any.
pub(crate) fn stated_increment_s(scan: &LaserScan) -> Option<f32> {
    Some(scan.time_increment_s).filter(|time_s| time_s.is_finite() && *time_s > 0.0)
}

/// The time from a scan to the next that a scan tells, if it tells any.
pub(crate) fn stated_scan_time_s(scan: &LaserScan) -> Option<f32> {
    Some(scan.scan_time_s).filter(|time_s| time_s.is_finite() && *time_s > 0.0)
}

/// Beam times of a laser that turns once a scan.
pub(crate) fn times_of_one_turn(scan: &LaserScan, period_s: f64) -> BeamTimes {
    let part_of_turn = f64::from(scan.angle_increment_rad).abs() / std::f64::consts::TAU;
    BeamTimes { time_increment_s: (period_s * part_of_turn) as f32, scan_time_s: period_s as f32 }
}

/// Replaces what is no range: nothing seen, and from the longest range on, by `+inf`; what is too near, and
/// codes below the shortest range, by NaN. Measured ranges stay as they are.
pub(crate) fn clean(scan: &mut LaserScan) {
    let is_set = |limit: f32| limit.is_finite() && limit > 0.0;
    if !is_set(scan.range_min_m) {
        scan.range_min_m = RANGES_M[0];
    }
    if !is_set(scan.range_max_m) || scan.range_max_m <= scan.range_min_m {
        scan.range_max_m = RANGES_M[1];
    }
    let [nearest, farthest] = [scan.range_min_m, scan.range_max_m - LIMIT_M];
    for range in &mut scan.ranges_m {
        if *range >= farthest {
            *range = f32::INFINITY;
        } else if range.is_nan() || *range < nearest {
            *range = f32::NAN;
        }
    }
    if scan.intensities.len() != scan.ranges_m.len() {
        scan.intensities.clear();
    }
}

/// From the first beam to the last, in ns.
pub(crate) fn sweep_ns(scan: &LaserScan) -> i64 {
    let steps = scan.ranges_m.len().saturating_sub(1) as f64;
    (steps * f64::from(scan.time_increment_s) * 1e9) as i64
}

#[cfg(test)]
mod tests {
    use super::{LaserScan, clean, times_of_one_turn};

    fn cleaned(range_min_m: f32, range_max_m: f32, ranges: &[f32]) -> Vec<f32> {
        let ranges_m = ranges.to_vec();
        let mut scan = LaserScan { range_min_m, range_max_m, ranges_m, ..LaserScan::default() };
        clean(&mut scan);
        scan.ranges_m
    }

    #[test]
    fn every_way_to_say_nothing_seen_is_known_and_what_is_measured_stays() {
        let (inf, nan) = (f32::INFINITY, f32::NAN);
        let found =
            cleaned(0.05, 25.0, &[1.234_567_8, 24.9, 25.0, 24.9995, 26.0, inf, 0.0, 0.019, nan, -inf]);
        assert_eq!(found[..2], [1.234_567_8, 24.9]);
        assert_eq!(found[2..6], [inf; 4]);
        assert!(found[6..].iter().all(|range| range.is_nan()), "{found:?}");
    }

    #[test]
    fn limits_that_are_none_are_those_of_any_scanner() {
        for limits in [[0.0, 0.0], [f32::NAN, f32::INFINITY], [0.5, 0.1], [-1.0, -1.0]] {
            let found = cleaned(limits[0], limits[1], &[0.6, 99.0, 100.0, 0.01]);
            assert_eq!(found[..3], [0.6, 99.0, f32::INFINITY], "{limits:?}");
            assert!(found[3].is_nan());
        }
    }

    #[test]
    fn a_laser_that_turns_the_other_way_takes_as_long() {
        for sign in [-1.0, 1.0] {
            let increment = sign * 0.5_f32.to_radians();
            let scan = LaserScan { angle_increment_rad: increment, ..LaserScan::default() };
            let times = times_of_one_turn(&scan, 0.1);
            assert!((times.time_increment_s - 0.1 / 720.0).abs() < 1e-9 && times.scan_time_s == 0.1);
        }
    }
}
