//! Values of a CARMEN line as ROS messages, and the rig that a log was recorded with as far as it tells.
//!
//! Geometry, as CARMEN takes it: n beams are 180/n degrees apart for even n, 180/(n-1) for odd; the first is
//! at -90.

use biplane_geometry::PortableMath;
use std::f64::consts::{FRAC_PI_2, PI};

use biplane_recording::Rig;
use biplane_recording::messages::{LaserScan, Odometry};
use biplane_recording::rig::{Laser, Mount};
use biplane_recording::topics::{FRAME_BASE, FRAME_LASER_HORIZONTAL, FRAME_ODOM};

use super::carmen_line::{LaserConfig, LaserLine, OdometryLine};

/// Resolutions that an LMS 2xx has, degrees.
const RESOLUTIONS_DEG: [f64; 3] = [0.25, 0.5, 1.0];
/// An LMS 2xx sees this wide at its finest resolution, degrees.
const NARROW_FOV_DEG: u16 = 100;

/// From a beam to the next where a log does not say, radians: n beams over half a circle, an odd n with both
/// ends.
fn increment_rad(beams: usize) -> f64 {
    match beams {
        0 | 1 => 0.0,
        odd if !odd.is_multiple_of(2) => PI / (odd - 1) as f64,
        even => PI / even as f64,
    }
}

/// First direction and increment of a line's fan, radians.
fn fov_rad(line: &LaserLine) -> (f64, f64) {
    match line.laser_config {
        Some(LaserConfig { first_rad, increment_rad, .. }) => (first_rad, increment_rad),
        None => (-FRAC_PI_2, increment_rad(line.ranges_m.len())),
    }
}

/// A scan. Ranges from `no_return_m` on, or from the line's own maximum on, are `+inf`; what is no positive
/// number is NaN. The log tells nothing of the time from beam to beam, so `time_increment` is 0.
pub(crate) fn scan(line: &LaserLine, no_return_m: Option<f64>, longest_m: f64) -> LaserScan {
    let (first_rad, increment_rad) = fov_rad(line);
    let own_limit_m = line.laser_config.map_or(f32::INFINITY, |laser_config| {
        if laser_config.max_range_m > 0.0 { laser_config.max_range_m } else { f32::INFINITY }
    });
    let limit_m = no_return_m.map_or(f32::INFINITY, |value| value as f32).min(own_limit_m);
    let range = |&range_m: &f32| match range_m {
        far if far >= limit_m => f32::INFINITY,
        range if range > 0.0 => range,
        _ => f32::NAN,
    };
    let last = line.ranges_m.len().saturating_sub(1) as f64;
    let remissions = &line.remissions;
    LaserScan {
        stamp_ns: line.stamp_ns,
        frame_id: FRAME_LASER_HORIZONTAL.to_owned(),
        angle_min_rad: first_rad as f32,
        angle_max_rad: (first_rad + last * increment_rad) as f32,
        angle_increment_rad: increment_rad as f32,
        time_increment_s: 0.0,
        scan_time_s: 0.0,
        range_min_m: 0.0,
        range_max_m: if limit_m.is_finite() { limit_m } else { longest_m as f32 },
        ranges_m: line.ranges_m.iter().map(range).collect(),
        intensities: if remissions.len() == line.ranges_m.len() { remissions.clone() } else { Vec::new() },
    }
}

/// An odometry message: pose `x, y, theta` and speeds.
pub(crate) fn odometry(line: &OdometryLine) -> Odometry {
    let [x, y, theta] = line.pose;
    let (sin, cos) = (theta / 2.0).portable_sin_cos();
    Odometry {
        stamp_ns: line.stamp_ns,
        frame_id: FRAME_ODOM.to_owned(),
        child_frame_id: FRAME_BASE.to_owned(),
        position_m: [x, y, 0.0],
        orientation_xyzw: [0.0, 0.0, sin, cos],
        linear_m_s: [line.forward_m_s, 0.0, 0.0],
        angular_rad_s: [0.0, 0.0, line.turn_rad_s],
        ..Odometry::default()
    }
}

/// A rig with one laser at the robot's center, of the settings nearest to the line's fan.
pub(crate) fn rig(line: &LaserLine) -> Rig {
    let increment_deg = fov_rad(line).1.to_degrees();
    let resolution_deg = RESOLUTIONS_DEG
        .into_iter()
        .min_by(|a, b| (a - increment_deg).abs().total_cmp(&(b - increment_deg).abs()))
        .unwrap_or(1.0);
    let span_deg = line.ranges_m.len().saturating_sub(1) as f64 * increment_deg;
    let narrow = resolution_deg < 0.5 || span_deg <= f64::from(NARROW_FOV_DEG);
    let fov_deg = if narrow { NARROW_FOV_DEG } else { 180 };
    let laser = Laser { fov_deg, resolution_deg, mount: Mount::default(), ..Laser::horizontal() };
    Rig { horizontal: laser, vertical: None, ..Rig::default() }
}

#[cfg(test)]
mod tests {
    use biplane_recording::Rig;

    use super::super::carmen_line::{Line, OdometryLine, parse_line};
    use super::{LaserLine, odometry, rig, scan};

    fn laser(text: &str) -> LaserLine {
        match parse_line(text) {
            Ok(Line::Laser(line)) => line,
            other => panic!("{other:?}"),
        }
    }

    fn flaser(beams: usize) -> LaserLine {
        laser(&format!("FLASER {beams} {} 0 0 0 0 0 0 1.5", "2.5 ".repeat(beams)))
    }

    #[test]
    fn a_scan_has_the_fan_that_its_number_of_beams_means() {
        // beams, increment in degrees, last beam, resolution and field of view of the rig
        let table = [
            (180, 1.0, 89.0, 1.0, 180),
            (181, 1.0, 90.0, 1.0, 180),
            (360, 0.5, 89.5, 0.5, 180),
            (361, 0.5, 90.0, 0.5, 180),
        ];
        for (beams, increment_deg, last_deg, resolution_deg, fov_deg) in table {
            let line = flaser(beams);
            let scan = scan(&line, None, 80.0);
            assert_eq!(scan.ranges_m.len(), beams);
            assert!((scan.angle_min_rad.to_degrees() + 90.0).abs() < 1e-4);
            assert!((f64::from(scan.angle_increment_rad).to_degrees() - increment_deg).abs() < 1e-6);
            assert!((f64::from(scan.angle_max_rad).to_degrees() - last_deg).abs() < 1e-4);
            let rig = rig(&line);
            assert_eq!((rig.horizontal.resolution_deg, rig.horizontal.fov_deg), (resolution_deg, fov_deg));
            assert_eq!(rig.horizontal.mount.translation_m(), [0.0; 3]);
            assert!(rig.vertical.is_none());
            assert_eq!(Rig::parse(&rig.to_toml()).unwrap(), rig);
        }
    }

    #[test]
    fn ranges_that_are_none_are_infinite_or_not_a_number() {
        let line = laser("FLASER 6 1.07 81.83 81.91 0 -1 nan 0 0 0 0 0 0 12.000000001");
        let scan = scan(&line, Some(81.83), 81.91);
        assert_eq!(scan.ranges_m[..3], [1.07, f32::INFINITY, f32::INFINITY]);
        assert!(scan.ranges_m[3..].iter().all(|range| range.is_nan()));
        assert_eq!((scan.stamp_ns, scan.range_max_m, scan.time_increment_s), (12_000_000_001, 81.83, 0.0));
        assert_eq!(scan.frame_id, "laser_horizontal");
    }

    #[test]
    fn a_line_that_tells_its_own_fan_and_maximum_is_believed() {
        let line =
            laser("RAWLASER1 0 -0.8726646 1.7453293 0.0174533 30.0 0.01 0 3 1 29.9 30 3 5 6 7 2.5 h 1");
        let scan = scan(&line, None, 30.0);
        assert_eq!(scan.ranges_m, [1.0, 29.9, f32::INFINITY]);
        assert_eq!(scan.intensities, [5.0, 6.0, 7.0]);
        assert!((scan.angle_min_rad.to_degrees() + 50.0).abs() < 1e-4);
        assert!((scan.angle_increment_rad.to_degrees() - 1.0).abs() < 1e-4);
        assert_eq!((rig(&line).horizontal.fov_deg, rig(&line).horizontal.resolution_deg), (100, 1.0));
    }

    #[test]
    fn odometry_keeps_pose_and_speeds() {
        let pose = [1.0, -2.0, std::f64::consts::PI];
        let message = odometry(&OdometryLine { pose, forward_m_s: 0.25, turn_rad_s: -0.5, stamp_ns: 9 });
        assert_eq!((message.position_m, message.stamp_ns), ([1.0, -2.0, 0.0], 9));
        assert!(
            (message.orientation_xyzw[2] - 1.0).abs() < 1e-12 && message.orientation_xyzw[3].abs() < 1e-12
        );
        assert_eq!((message.linear_m_s[0], message.angular_rad_s[2]), (0.25, -0.5));
        assert_eq!((message.frame_id.as_str(), message.child_frame_id.as_str()), ("odom", "base_link"));
    }
}
