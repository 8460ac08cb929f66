//! What a scan saw, as the matcher's end points: de-skewed, each with the direction of the surface that it lies on.
//!
//! Frame: the base at the scan's stamp, projected to the floor. Metres. How points come about is the matcher's own (`points` of
//! `biplane-matcher`), so that a scan is the same here and on the robot.

use biplane_matcher::{Beam, EndPoint, EndPoints, PointParams, Scan};
use biplane_recording::msg::LaserScan;
use nalgebra::Vector3;

use crate::cloud::Fan;

/// The end points of one scan, in the order of its beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// The end points.
    pub points: Vec<EndPoint>,
    /// Where they were seen from.
    pub laser_m: [f32; 2],
}

/// Makes outlines, in the same memory one after the other.
#[derive(Clone, Debug)]
pub struct Outliner {
    points: EndPoints,
    beams: Vec<Beam>,
}

impl Outliner {
    /// Of beams up to `longest_m`.
    pub fn new(longest_m: f64) -> Self {
        let params = PointParams { range_max_m: longest_m, ..PointParams::default() };
        Self { points: EndPoints::new(params), beams: Vec::new() }
    }

    /// The outline of a scan. `twist` is the base's velocity in its own frame: ahead, left (m/s), turn (rad/s).
    pub fn outline(&mut self, scan: &LaserScan, fan: &Fan, twist: [f64; 3]) -> Outline {
        let laser = fan.base_from_laser.translation.vector;
        self.beams.clear();
        self.beams.extend(scan.ranges_m.iter().zip(&fan.beams).map(|(&range_m, beam)| {
            let (sin, cos) = beam.angle_rad.sin_cos();
            let direction = fan.base_from_laser * Vector3::new(cos, sin, 0.0);
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
        Outline { points: self.points.as_slice().to_vec(), laser_m: self.points.laser_in_base_m() }
    }
}
