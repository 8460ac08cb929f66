//! What a scan saw, as the matcher's end points: de-skewed, each with the direction of the surface that it
//! lies on.
//!
//! Frame: the base at the scan's stamp, projected to the floor. Meters. How points come about is the
//! matcher's own (`points` of `biplane-matcher`), so that a scan is the same here and on the robot.

use biplane_geometry::PortableMath;
use biplane_matcher::{Beam, EndPoint, EndPoints, Placement, PointParams, Pose2, Scan};
use biplane_recording::messages::LaserScan;
use nalgebra::Vector3;

use crate::recordings::scan_geometry::ScanGeometry;

/// The end points of one scan, in the order of its beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyframeScan {
    /// The end points.
    pub points: Vec<EndPoint>,
    /// Where they were seen from.
    pub laser_m: [f32; 2],
}

/// All points of keyframe scans, each placed by its pose.
pub(crate) fn merged<'a>(keyframe_scans: impl Iterator<Item = (Pose2, &'a KeyframeScan)>) -> Vec<EndPoint> {
    let mut points = Vec::new();
    for (pose, keyframe_scan) in keyframe_scans {
        let placement = Placement::new(&pose);
        points.extend(keyframe_scan.points.iter().map(|point| point.placed(&placement)));
    }
    points
}

/// Makes keyframe scans, in the same memory one after the other.
#[derive(Clone, Debug)]
pub(crate) struct KeyframeScanner {
    points: EndPoints,
    beams: Vec<Beam>,
}

impl KeyframeScanner {
    /// Of beams up to `longest_m`.
    pub(crate) fn new(longest_m: f64) -> Self {
        let params = PointParams { range_max_m: longest_m, ..PointParams::default() };
        Self { points: EndPoints::new(params), beams: Vec::new() }
    }

    /// The keyframe scan of a scan. `twist` is the base's velocity in its own frame: ahead, left (m/s), turn
    /// (rad/s).
    pub(crate) fn keyframe_scan(
        &mut self,
        scan: &LaserScan,
        geometry: &ScanGeometry,
        twist: [f64; 3],
    ) -> KeyframeScan {
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
            twist_in_base: twist,
        });
        KeyframeScan { points: self.points.as_slice().to_vec(), laser_m: self.points.laser_in_base_m() }
    }
}
