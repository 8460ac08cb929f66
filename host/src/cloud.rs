//! The raw 3D points: every beam of the vertical laser that hit something, in `map`, at its own time.
//!
//! A beam's time is the mirror's time (interfaces.md section 2), its pose the trajectory's at that time ([`crate::deskew`]).
//! Metres, radians, nanoseconds. Source: the paper, section 2.3.

use crate::deskew::{StampedPose, Trajectory};
use crate::model::Cloud;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

/// One beam of a laser's fan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanBeam {
    /// Direction in the laser's frame, counter-clockwise from its x axis, radians.
    pub angle_rad: f64,
    /// Time of the beam after the scan's stamp, nanoseconds.
    pub delay_ns: i64,
}

/// The geometry and timing of a scanning laser on the base.
#[derive(Clone, Debug, PartialEq)]
pub struct Fan {
    /// Pose of the laser in `base_link`.
    pub base_from_laser: Isometry3<f64>,
    /// The beams in the order of a scan's ranges.
    pub beams: Vec<FanBeam>,
}

/// One scan: its stamp and a range for every beam of the fan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Time of the scan's stamp, nanoseconds.
    pub stamp_ns: i64,
    /// Distances, metres; infinite or NaN where nothing was measured.
    pub ranges_m: Vec<f32>,
}

/// What becomes a point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloudParams {
    /// Nearer echoes are the robot itself, metres. Larger: blind near the robot. Smaller: the robot's own parts in the model.
    pub min_range_m: f32,
    /// Farther echoes are left out, metres. Larger: sparse, uncertain far points. Smaller: high ceilings and facades are cut.
    pub max_range_m: f32,
    /// A scan is dropped when the base moved less than this since the last kept one, metres, and turned less than
    /// `still_angle_deg`. Larger: coarser sweeps. Zero: a robot that stands still piles up points in one place.
    pub still_distance_m: f64,
    /// See `still_distance_m`, degrees.
    pub still_angle_deg: f64,
    /// Longest time between two poses, and beyond the first or last, that is bridged, seconds. Larger: points with a guessed pose.
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

/// A cloud and what was left out of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosedCloud {
    /// The points.
    pub cloud: Cloud,
    /// Scans dropped because the robot had not moved.
    pub scans_still: usize,
    /// Scans dropped because the trajectory does not cover their time.
    pub scans_unposed: usize,
    /// Beams of kept scans that give no point: no echo, out of the range limits, without a pose.
    pub beams_empty: usize,
}

/// Poses every beam of every sweep. Sweeps are taken in the order given; ranges beyond the fan's beams are ignored.
pub fn pose_sweeps(params: &CloudParams, fan: &Fan, sweeps: &[Sweep], trajectory: &Trajectory) -> PosedCloud {
    let mut out = PosedCloud::default();
    let beams = fan.beams.len().min(usize::from(u16::MAX));
    out.cloud.beams_per_scan = beams;
    out.cloud.delays_ns = fan.beams.iter().take(beams).map(|beam| beam.delay_ns).collect();
    let Some(middle) = fan.beams.get(beams / 2) else {
        out.scans_unposed = sweeps.len();
        return out;
    };
    let gap_ns = seconds_to_ns(params.max_pose_gap_s);
    let mut last_kept: Option<StampedPose> = None;
    for sweep in sweeps {
        let Some(pose) = trajectory.at(sweep.stamp_ns.saturating_add(middle.delay_ns), gap_ns) else {
            out.scans_unposed += 1;
            continue;
        };
        if last_kept.is_some_and(|last| stands_still(params, &last, &pose)) {
            out.scans_still += 1;
            continue;
        }
        last_kept = Some(pose);
        pose_beams(params, fan, sweep, trajectory, &mut out);
        let origin = map_from_base(&pose) * fan.base_from_laser.translation.vector;
        out.cloud.origins_m.push(to_f32(origin.into()));
        out.cloud.stamps_ns.push(sweep.stamp_ns);
    }
    out
}

fn pose_beams(params: &CloudParams, fan: &Fan, sweep: &Sweep, trajectory: &Trajectory, out: &mut PosedCloud) {
    let scan = out.cloud.origins_m.len() as u32;
    let gap_ns = seconds_to_ns(params.max_pose_gap_s);
    let before = out.cloud.len();
    for (index, (beam, &range_m)) in fan.beams.iter().zip(&sweep.ranges_m).enumerate() {
        let Ok(index) = u16::try_from(index) else { break };
        if !(range_m >= params.min_range_m && range_m <= params.max_range_m) {
            continue;
        }
        let Some(pose) = trajectory.at(sweep.stamp_ns.saturating_add(beam.delay_ns), gap_ns) else {
            continue;
        };
        let (sin, cos) = beam.angle_rad.sin_cos();
        let in_laser = Point3::new(cos, sin, 0.0) * f64::from(range_m);
        let in_map = map_from_base(&pose) * (fan.base_from_laser * in_laser).coords;
        out.cloud.points_m.push(to_f32(in_map.into()));
        out.cloud.scan.push(scan);
        out.cloud.beam.push(index);
    }
    out.beams_empty += out.cloud.beams_per_scan - (out.cloud.len() - before);
}

fn stands_still(params: &CloudParams, last: &StampedPose, now: &StampedPose) -> bool {
    let moved_m = (now.x_m - last.x_m).hypot(now.y_m - last.y_m);
    moved_m < params.still_distance_m && last.turn_rad(now).abs().to_degrees() < params.still_angle_deg
}

/// A planar pose as a map of vectors: turn about z, then move in the floor's plane.
struct Planar(Isometry3<f64>);

fn map_from_base(pose: &StampedPose) -> Planar {
    Planar(Isometry3::from_parts(
        Translation3::new(pose.x_m, pose.y_m, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.theta_rad),
    ))
}

impl std::ops::Mul<Vector3<f64>> for Planar {
    type Output = Vector3<f64>;

    fn mul(self, in_base: Vector3<f64>) -> Vector3<f64> {
        (self.0 * Point3::from(in_base)).coords
    }
}

fn seconds_to_ns(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

fn to_f32(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::{CloudParams, Fan, FanBeam, Sweep, pose_sweeps};
    use crate::deskew::{StampedPose, Trajectory};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use std::f64::consts::FRAC_PI_2;

    /// A laser 0.45 m up whose fan's middle points up: pitch -90 degrees, as in the default rig.
    fn upright(beams: Vec<FanBeam>) -> Fan {
        let rotation = UnitQuaternion::from_euler_angles(0.0, -FRAC_PI_2, 0.0);
        Fan { base_from_laser: Isometry3::from_parts(Translation3::new(0.05, 0.0, 0.45), rotation), beams }
    }

    fn driving_along_x(metres_per_s: f64) -> Trajectory {
        let at = |s: i64| StampedPose {
            stamp_ns: s * 1_000_000_000,
            x_m: metres_per_s * s as f64,
            y_m: 0.0,
            theta_rad: 0.0,
        };
        Trajectory::new((0..11).map(at).collect())
    }

    #[test]
    fn the_first_beam_looks_right_the_middle_one_up_each_from_where_the_robot_was_then() {
        let fan = upright(vec![
            FanBeam { angle_rad: -FRAC_PI_2, delay_ns: 0 },
            FanBeam { angle_rad: 0.0, delay_ns: 1_000_000_000 },
            FanBeam { angle_rad: FRAC_PI_2, delay_ns: 2_000_000_000 },
        ]);
        let sweep = Sweep { stamp_ns: 0, ranges_m: vec![1.0, 2.0, 3.0] };
        let posed = pose_sweeps(
            &CloudParams { max_pose_gap_s: 2.0, ..Default::default() },
            &fan,
            &[sweep],
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
        let fan = upright((0..5).map(|i| FanBeam { angle_rad: 0.1 * f64::from(i), delay_ns: 0 }).collect());
        let ranges_m = vec![f32::INFINITY, 1.0, f32::NAN, 99.0, 2.0];
        let posed = pose_sweeps(
            &CloudParams::default(),
            &fan,
            &[Sweep { stamp_ns: 5, ranges_m }],
            &driving_along_x(1.0),
        );
        assert_eq!(posed.cloud.beam, [1, 4]);
        assert_eq!(posed.beams_empty, 3);
        assert_eq!(posed.cloud.beams_per_scan, 5);
    }

    #[test]
    fn a_robot_that_stands_still_keeps_one_scan() {
        let fan = upright(vec![FanBeam { angle_rad: 0.0, delay_ns: 0 }]);
        let sweeps: Vec<_> =
            (0..10).map(|i| Sweep { stamp_ns: i * 100_000_000, ranges_m: vec![1.0] }).collect();
        let still = pose_sweeps(&CloudParams::default(), &fan, &sweeps, &driving_along_x(0.0));
        assert_eq!((still.cloud.len(), still.scans_still), (1, 9));
        let moving = pose_sweeps(&CloudParams::default(), &fan, &sweeps, &driving_along_x(1.0));
        assert_eq!((moving.cloud.len(), moving.scans_still), (10, 0));
    }

    #[test]
    fn scans_that_the_trajectory_does_not_cover_are_counted() {
        let fan = upright(vec![FanBeam { angle_rad: 0.0, delay_ns: 0 }]);
        let late = Sweep { stamp_ns: 60_000_000_000, ranges_m: vec![1.0] };
        let posed = pose_sweeps(&CloudParams::default(), &fan, &[late], &driving_along_x(1.0));
        assert_eq!((posed.cloud.len(), posed.scans_unposed), (0, 1));
        assert!(pose_sweeps(&CloudParams::default(), &fan, &[], &Trajectory::default()).cloud.is_empty());
    }
}
