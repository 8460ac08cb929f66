//! What a scan saw, as the matcher's end points: de-skewed, each with the direction of the surface that it
//! lies on.
//!
//! Frame: the base at the scan's stamp, projected to the floor. Meters. How points come about is the
//! matcher's own (`points` of `biplane-matcher`), so that a scan is the same here and on the robot.

use biplane_geometry::PortableMath;
use biplane_matcher::{Beam, EndPoint, EndPoints, Placement, PointParams, Pose2, Scan, free_standing};
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::Laser;
use nalgebra::Vector3;

use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::run::scan_geometry_of;
use crate::recordings::scan_geometry::ScanGeometry;

/// Poses farther apart than this are not bridged, nanoseconds.
const LONGEST_GAP_NS: i64 = 1_000_000_000;

/// The end points of one scan, in the order of its beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyframeScan {
    /// The end points.
    pub points: Vec<EndPoint>,
    /// Where they were seen from.
    pub laser_m: [f32; 2],
}

impl KeyframeScan {
    /// One in so many of its beams when it was taken at a pose: where each begins and ends.
    pub(crate) fn beams(&self, pose: &Pose2, every: usize) -> impl Iterator<Item = [[f32; 2]; 2]> {
        let placement = Placement::new(pose);
        let from_m = placement.place(self.laser_m);
        self.points.iter().step_by(every).map(move |point| [from_m, placement.place(point.at_m)])
    }
}

/// The points of several keyframe scans, each placed by its scan's pose.
pub(crate) fn merged<'a>(
    scans: impl Iterator<Item = (Pose2, impl IntoIterator<Item = &'a EndPoint>)>,
) -> Vec<EndPoint> {
    let mut merged = Vec::new();
    for (pose, points) in scans {
        let placement = Placement::new(&pose);
        merged.extend(points.into_iter().map(|point| point.placed(&placement)));
    }
    merged
}

/// Makes keyframe scans of one laser, in the same memory one after the other.
#[derive(Clone, Debug)]
pub(crate) struct KeyframeScanner {
    laser: Laser,
    /// Of the last scan; that of the next one is the same when it has as many beams.
    geometry: Option<ScanGeometry>,
    points: EndPoints,
    beams: Vec<Beam>,
}

impl KeyframeScanner {
    /// Of beams up to `longest_m`.
    pub(crate) fn new(laser: Laser, longest_m: f64) -> Self {
        let params = PointParams { range_max_m: longest_m, ..PointParams::default() };
        Self { laser, geometry: None, points: EndPoints::new(params), beams: Vec::new() }
    }

    /// The keyframe scan of a scan that was taken at a pose on the way.
    pub(crate) fn keyframe_scan(
        &mut self,
        scan: &LaserScan,
        pose: &StampedPose,
        trajectory: &Trajectory,
    ) -> KeyframeScan {
        let known = self.geometry.take().filter(|known| known.beams.len() == scan.ranges_m.len());
        let geometry = self.geometry.insert(known.unwrap_or_else(|| scan_geometry_of(scan, &self.laser)));
        let laser = geometry.base_from_laser.translation.vector;
        self.beams.clear();
        self.beams.extend(scan.ranges_m.iter().zip(&geometry.beams).map(|(&range_m, beam)| {
            let (sin, cos) = beam.angle_rad.portable_sin_cos();
            let direction = geometry.base_from_laser * Vector3::new(cos, sin, 0.0);
            Beam {
                direction_in_base: [direction.x as f32, direction.y as f32],
                range_m,
                delay_s: (beam.delay_ns as f64 * 1e-9) as f32,
            }
        }));
        self.points.fill(&Scan {
            stamp_ns: scan.stamp_ns,
            laser_in_base_m: [laser.x, laser.y],
            beams: &self.beams,
            twist_in_base: twist(scan, geometry, pose, trajectory),
        });
        KeyframeScan { points: self.points.as_slice().to_vec(), laser_m: self.points.laser_in_base_m() }
    }

    /// The numbers of the last scan's end points on something short that stands free, ascending.
    pub(crate) fn free_standing(&self) -> Vec<usize> {
        free_standing(&self.points)
    }
}

/// The base's velocity in its own frame, ahead, left (m/s), turn (rad/s), while its mirror turned;
/// zeros where beams have no times of their own.
fn twist(scan: &LaserScan, geometry: &ScanGeometry, pose: &StampedPose, trajectory: &Trajectory) -> [f64; 3] {
    let delay_ns = geometry.beams.iter().map(|beam| beam.delay_ns).max().unwrap_or(0);
    if delay_ns <= 0 {
        return [0.0; 3];
    }
    // Over a little more than a scan: two poses a few milliseconds apart tell the speed badly.
    let span_ns = delay_ns.max(100_000_000);
    let at = |stamp_ns: i64| trajectory.at(stamp_ns, LONGEST_GAP_NS).map_or(pose.pose(), |pose| pose.pose());
    let (from, to) = (at(scan.stamp_ns - span_ns / 2), at(scan.stamp_ns.saturating_add(span_ns / 2)));
    let way = from.between(&to);
    [way.x_m, way.y_m, way.theta_rad].map(|part| part / (span_ns as f64 * 1e-9))
}
