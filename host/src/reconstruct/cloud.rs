//! The raw 3D points: every beam of the vertical laser that hit something, in `map`, at its own time.
//!
//! A beam's time is the mirror's time (`docs/time.md`), its pose the trajectory's at that time
//! ([`crate::recordings::deskew`]). Meters, radians, nanoseconds. Source: the paper, section 2.3.

use crate::model::Cloud;
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::scan_geometry::{BeamGeometry, MAX_BEAMS_PER_SCAN, RangeScan, ScanGeometry};
use biplane_geometry::PortableMath;
use nalgebra::Vector3;
use serde::Serialize;

/// What becomes a point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloudParams {
    /// Nearer echoes are the robot itself, meters. Larger: blind near the robot. Smaller: the robot's own
    /// parts in the model.
    pub min_range_m: f32,
    /// Farther echoes are left out, meters. Larger: sparse, uncertain far points. Smaller: high ceilings and
    /// facades are cut.
    pub max_range_m: f32,
    /// A scan is dropped when the base moved less than this since the last kept one, meters, and turned less
    /// than `still_angle_deg`. Larger: coarser scans. Zero: a robot that stands still piles up points in one
    /// place.
    pub still_distance_m: f64,
    /// See `still_distance_m`, degrees.
    pub still_angle_deg: f64,
    /// Longest time between two poses, and beyond the first or last, that is bridged, seconds. Larger: points
    /// with a guessed pose.
    pub max_pose_gap_s: f64,
}

impl Default for CloudParams {
    fn default() -> Self {
        Self {
            min_range_m: 0.05,
            max_range_m: 30.0,
            still_distance_m: 0.005,
            still_angle_deg: 0.1,
            max_pose_gap_s: 1.0,
        }
    }
}

/// What was left out of a drive's cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LeftOut {
    /// Scans dropped because the robot had not moved.
    pub scans_still: usize,
    /// Scans dropped because the trajectory does not cover their time.
    pub scans_unposed: usize,
    /// Beams of kept scans that give no point: no echo, out of the range limits, without a pose, or without
    /// an index.
    pub beams_empty: usize,
}

/// One scan's points.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PosedScan {
    /// Where the laser was at the scan's middle beam, meters in `map`.
    pub origin_m: [f32; 3],
    /// The base's heading at that beam, radians.
    pub theta_rad: f64,
    /// The scan's stamp, nanoseconds.
    pub stamp_ns: i64,
    /// The points, in the order of their beams.
    pub points_m: Vec<[f32; 3]>,
    /// The beam of each.
    pub beams: Vec<u16>,
}

/// Poses a drive scan by scan, so that nobody has to hold all of its points.
pub(crate) struct ScanPoser<'a> {
    params: &'a CloudParams,
    geometry: &'a ScanGeometry,
    trajectory: &'a Trajectory,
    /// The unit vector of each beam in `base_link`.
    directions: Vec<Vector3<f64>>,
    last_kept: Option<StampedPose>,
    /// What was left out so far.
    pub left_out: LeftOut,
}

impl<'a> ScanPoser<'a> {
    /// At the start of a drive.
    pub(crate) fn new(
        params: &'a CloudParams,
        geometry: &'a ScanGeometry,
        trajectory: &'a Trajectory,
    ) -> Self {
        let direction = |beam: &BeamGeometry| {
            let (sin, cos) = beam.angle_rad.portable_sin_cos();
            geometry.base_from_laser.rotation * Vector3::new(cos, sin, 0.0)
        };
        let directions = geometry.beams.iter().map(direction).collect();
        Self { params, geometry, trajectory, directions, last_kept: None, left_out: LeftOut::default() }
    }

    /// A cloud without points that knows the laser.
    pub(crate) fn empty_cloud(&self) -> Cloud {
        let beams = self.geometry.beams.len().min(MAX_BEAMS_PER_SCAN);
        let delays_ns = self.geometry.beams.iter().take(beams).map(|beam| beam.delay_ns).collect();
        Cloud { beams_per_scan: beams, delays_ns, ..Cloud::default() }
    }

    /// Poses the next scan into `row`, each beam at its own time; `false` when the scan is left out. Ranges
    /// beyond the fan's beams are ignored, beams beyond the 65,535th give no point.
    pub(crate) fn pose(&mut self, range_scan: &RangeScan, row: &mut PosedScan) -> bool {
        let gap_ns = seconds_to_ns(self.params.max_pose_gap_s);
        let middle = self.geometry.beams.get(self.geometry.beams.len().min(MAX_BEAMS_PER_SCAN) / 2);
        let at_middle = middle.and_then(|middle| {
            self.trajectory.at(range_scan.stamp_ns.saturating_add(middle.delay_ns), gap_ns)
        });
        let Some(pose) = at_middle else {
            self.left_out.scans_unposed += 1;
            return false;
        };
        if self.last_kept.is_some_and(|last| stands_still(self.params, &last, &pose)) {
            self.left_out.scans_still += 1;
            return false;
        }
        self.last_kept = Some(pose);
        self.pose_beams(range_scan, gap_ns, row);
        let origin = in_map(&pose, self.geometry.base_from_laser.translation.vector);
        (row.origin_m, row.theta_rad, row.stamp_ns) = (origin, pose.theta_rad, range_scan.stamp_ns);
        true
    }

    fn pose_beams(&mut self, range_scan: &RangeScan, gap_ns: i64, row: &mut PosedScan) {
        row.points_m.clear();
        row.beams.clear();
        let laser = self.geometry.base_from_laser.translation.vector;
        let beams = self.geometry.beams.iter().zip(&self.directions).zip(&range_scan.ranges_m);
        for (index, ((beam, direction), &range_m)) in (0..u16::MAX).zip(beams) {
            if !(range_m >= self.params.min_range_m && range_m <= self.params.max_range_m) {
                continue;
            }
            let stamp_ns = range_scan.stamp_ns.saturating_add(beam.delay_ns);
            let Some(pose) = self.trajectory.at(stamp_ns, gap_ns) else { continue };
            row.points_m.push(in_map(&pose, laser + direction * f64::from(range_m)));
            row.beams.push(index);
        }
        self.left_out.beams_empty += self.geometry.beams.len() - row.points_m.len();
    }
}

fn stands_still(params: &CloudParams, last: &StampedPose, now: &StampedPose) -> bool {
    let moved_m = (now.x_m - last.x_m).portable_hypot(now.y_m - last.y_m);
    moved_m < params.still_distance_m && last.turn_rad(now).abs().to_degrees() < params.still_angle_deg
}

fn in_map(pose: &StampedPose, p: Vector3<f64>) -> [f32; 3] {
    pose.transform(p.into()).map(|v| v as f32)
}

fn seconds_to_ns(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

#[cfg(test)]
mod tests {
    use super::{CloudParams, LeftOut, PosedScan, ScanPoser};
    use crate::model::Cloud;
    use crate::recordings::deskew::{StampedPose, Trajectory};
    use crate::recordings::scan_geometry::BeamGeometry;
    use crate::recordings::scan_geometry::RangeScan;
    use crate::recordings::scan_geometry::ScanGeometry;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use std::f64::consts::FRAC_PI_2;

    struct Posed {
        cloud: Cloud,
        left_out: LeftOut,
    }

    /// All scans as one cloud.
    fn pose_scans(
        params: &CloudParams,
        geometry: &ScanGeometry,
        range_scans: &[RangeScan],
        trajectory: &Trajectory,
    ) -> Posed {
        let mut poser = ScanPoser::new(params, geometry, trajectory);
        let mut cloud = poser.empty_cloud();
        let mut row = PosedScan::default();
        for range_scan in range_scans {
            if poser.pose(range_scan, &mut row) {
                cloud.scan.extend(row.points_m.iter().map(|_| cloud.origins_m.len() as u32));
                cloud.points_m.extend(&row.points_m);
                cloud.beam.extend(&row.beams);
                cloud.origins_m.push(row.origin_m);
            }
        }
        Posed { cloud, left_out: poser.left_out }
    }

    /// A laser 0.45 m up whose fan's middle points up: pitch -90 degrees, as in the default rig.
    fn upright(beams: Vec<BeamGeometry>) -> ScanGeometry {
        let rotation = UnitQuaternion::from_euler_angles(0.0, -FRAC_PI_2, 0.0);
        ScanGeometry {
            base_from_laser: Isometry3::from_parts(Translation3::new(0.05, 0.0, 0.45), rotation),
            beams,
        }
    }

    fn driving_along_x(meters_per_s: f64) -> Trajectory {
        let at = |s: i64| StampedPose {
            stamp_ns: s * 1_000_000_000,
            x_m: meters_per_s * s as f64,
            y_m: 0.0,
            ..StampedPose::default()
        };
        Trajectory::new((0..11).map(at).collect())
    }

    #[test]
    fn the_first_beam_looks_right_the_middle_one_up_each_from_where_the_robot_was_then() {
        let geometry = upright(vec![
            BeamGeometry { angle_rad: -FRAC_PI_2, delay_ns: 0 },
            BeamGeometry { angle_rad: 0.0, delay_ns: 1_000_000_000 },
            BeamGeometry { angle_rad: FRAC_PI_2, delay_ns: 2_000_000_000 },
        ]);
        let range_scan = RangeScan { stamp_ns: 0, ranges_m: vec![1.0, 2.0, 3.0] };
        let posed = pose_scans(
            &CloudParams { max_pose_gap_s: 2.0, ..Default::default() },
            &geometry,
            &[range_scan],
            &driving_along_x(1.0),
        );
        let expected = [[0.05, -1.0, 0.45], [1.05, 0.0, 2.45], [2.05, 3.0, 0.45]];
        assert_eq!(posed.cloud.len(), 3);
        for (point, want) in posed.cloud.points_m.iter().zip(expected) {
            assert!(
                point.iter().zip(want).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6),
                "{point:?} is not {want:?}"
            );
        }
        assert!((posed.cloud.origins_m[0][0] - 1.05).abs() < 1e-6);
    }

    #[test]
    fn beams_without_an_echo_leave_holes_that_keep_their_index() {
        let geometry =
            upright((0..5).map(|i| BeamGeometry { angle_rad: 0.1 * f64::from(i), delay_ns: 0 }).collect());
        let ranges_m = vec![f32::INFINITY, 1.0, f32::NAN, 99.0, 2.0];
        let posed = pose_scans(
            &CloudParams::default(),
            &geometry,
            &[RangeScan { stamp_ns: 5, ranges_m }],
            &driving_along_x(1.0),
        );
        assert_eq!(posed.cloud.beam, [1, 4]);
        assert_eq!(posed.left_out.beams_empty, 3);
        assert_eq!(posed.cloud.beams_per_scan, 5);
    }

    #[test]
    fn beams_beyond_the_last_index_give_no_point_and_are_counted() {
        let last = usize::from(u16::MAX);
        for (extra, empty) in [(0, 0), (1, 1), (3, 3)] {
            let geometry = upright(vec![BeamGeometry { angle_rad: 0.0, delay_ns: 0 }; last + extra]);
            let range_scan = RangeScan { stamp_ns: 5, ranges_m: vec![1.0; last + extra] };
            let posed = pose_scans(&CloudParams::default(), &geometry, &[range_scan], &driving_along_x(1.0));
            assert_eq!((posed.cloud.len(), posed.left_out.beams_empty), (last, empty));
            assert_eq!((posed.cloud.beams_per_scan, posed.cloud.delays_ns.len()), (last, last));
            assert_eq!(posed.cloud.beam.last(), Some(&(u16::MAX - 1)));
        }
    }

    #[test]
    fn a_robot_that_stands_still_keeps_one_scan() {
        let geometry = upright(vec![BeamGeometry { angle_rad: 0.0, delay_ns: 0 }]);
        let range_scans: Vec<_> =
            (0..10).map(|i| RangeScan { stamp_ns: i * 100_000_000, ranges_m: vec![1.0] }).collect();
        let still = pose_scans(&CloudParams::default(), &geometry, &range_scans, &driving_along_x(0.0));
        assert_eq!((still.cloud.len(), still.left_out.scans_still), (1, 9));
        let moving = pose_scans(&CloudParams::default(), &geometry, &range_scans, &driving_along_x(1.0));
        assert_eq!((moving.cloud.len(), moving.left_out.scans_still), (10, 0));
    }

    #[test]
    fn scans_that_the_trajectory_does_not_cover_are_counted() {
        let geometry = upright(vec![BeamGeometry { angle_rad: 0.0, delay_ns: 0 }]);
        let late = RangeScan { stamp_ns: 60_000_000_000, ranges_m: vec![1.0] };
        let posed = pose_scans(&CloudParams::default(), &geometry, &[late], &driving_along_x(1.0));
        assert_eq!((posed.cloud.len(), posed.left_out.scans_unposed), (0, 1));
        assert!(pose_scans(&CloudParams::default(), &geometry, &[], &Trajectory::default()).cloud.is_empty());
    }
}
