//! What a scan saw, as end points with the directions of the surfaces that they lie on.
//!
//! Frame: the base at the scan's stamp, projected to the floor. Metres. Beams are put where the base was when they were taken.

use biplane_recording::msg::LaserScan;
use nalgebra::Point3;

use crate::cloud::Fan;

/// Shorter ranges are the robot itself, metres.
const NEAREST_M: f32 = 0.1;
/// Beams on either side that a normal looks at.
const NEIGHBOURS: usize = 6;
/// Neighbours off their common line by more than this (root mean square) have no normal, metres.
const LINE_TOLERANCE_M: f32 = 0.025;
/// Neighbours that span less than this have no normal, metres.
const LINE_LENGTH_M: f32 = 0.06;
/// Beams that end closer together than this share one beam's weight, metres.
const SPACING_M: f32 = 0.03;

/// One end point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutlinePoint {
    /// Where the beam ended.
    pub at_m: [f32; 2],
    /// Unit normal of the surface there, towards the laser; zeros where it has none.
    pub normal: [f32; 2],
    /// Weight in (0, 1]: less where beams are crowded.
    pub weight: f32,
}

impl OutlinePoint {
    /// Whether the surface's direction is known.
    pub fn has_normal(&self) -> bool {
        self.normal != [0.0; 2]
    }
}

/// The end points of one scan, in the order of its beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// The end points.
    pub points: Vec<OutlinePoint>,
    /// Where they were seen from.
    pub laser_m: [f32; 2],
}

impl Outline {
    /// The end points of a scan up to `longest_m`. `twist` is the base's velocity in its own frame: ahead, left (m/s), turn (rad/s).
    pub fn of(scan: &LaserScan, fan: &Fan, twist: [f64; 3], longest_m: f32) -> Self {
        let origin = fan.base_from_laser.translation.vector;
        let mut points = Vec::with_capacity(scan.ranges_m.len());
        for (&range_m, beam) in scan.ranges_m.iter().zip(&fan.beams) {
            if !(NEAREST_M..=longest_m).contains(&range_m) {
                continue; // also NaN and no echo
            }
            let (sin, cos) = beam.angle_rad.sin_cos();
            let end = fan.base_from_laser * (Point3::new(cos, sin, 0.0) * f64::from(range_m));
            let at_m = moved([end.x, end.y], twist, beam.delay_ns as f64 * 1e-9);
            points.push(OutlinePoint { at_m, normal: [0.0; 2], weight: 1.0 });
        }
        let mut outline = Self { points, laser_m: [origin.x as f32, origin.y as f32] };
        outline.find_normals();
        outline
    }

    fn find_normals(&mut self) {
        let found: Vec<_> =
            (0..self.points.len()).map(|index| (self.normal_at(index), self.weight_at(index))).collect();
        for (point, (normal, weight)) in self.points.iter_mut().zip(found) {
            (point.normal, point.weight) = (normal, weight);
        }
    }

    /// The direction of the line through a point's neighbours on both sides.
    fn normal_at(&self, index: usize) -> [f32; 2] {
        let here = self.points[index].at_m;
        let range_m = distance(here, self.laser_m);
        let reach_m = 0.2 + 0.03 * range_m;
        let near = |other: &&OutlinePoint| distance(other.at_m, here) <= reach_m;
        let before = self.points[..index].iter().rev().take(NEIGHBOURS).take_while(near).count();
        let after = self.points[index + 1..].iter().take(NEIGHBOURS).take_while(near).count();
        let run = &self.points[index - before..=index + after];
        if run.len() < 3 || distance(run[0].at_m, run[run.len() - 1].at_m) < LINE_LENGTH_M {
            return [0.0; 2];
        }
        let Some((normal, spread_m)) = line_through(run) else { return [0.0; 2] };
        if spread_m > LINE_TOLERANCE_M {
            return [0.0; 2];
        }
        let facing = normal[0] * (self.laser_m[0] - here[0]) + normal[1] * (self.laser_m[1] - here[1]);
        // Struck too flatly: the beams may lie on both sides of an edge.
        if facing.abs() < 0.08 * range_m {
            return [0.0; 2];
        }
        if facing < 0.0 { [-normal[0], -normal[1]] } else { normal }
    }

    fn weight_at(&self, index: usize) -> f32 {
        let here = self.points[index].at_m;
        let gap = |other: Option<&OutlinePoint>| other.map_or(SPACING_M, |other| distance(other.at_m, here));
        let before = index.checked_sub(1).and_then(|index| self.points.get(index));
        let both = gap(before).min(SPACING_M) + gap(self.points.get(index + 1)).min(SPACING_M);
        (both / (2.0 * SPACING_M)).max(0.05)
    }
}

/// A point of a moving base's scan, taken `delay_s` after the stamp, in the frame of the stamp.
fn moved(at_m: [f64; 2], twist: [f64; 3], delay_s: f64) -> [f32; 2] {
    let (sin, cos) = (twist[2] * delay_s).sin_cos();
    [
        (twist[0] * delay_s + cos * at_m[0] - sin * at_m[1]) as f32,
        (twist[1] * delay_s + sin * at_m[0] + cos * at_m[1]) as f32,
    ]
}

/// The normal of the line through points by least squares, and their root mean square distance from it.
fn line_through(points: &[OutlinePoint]) -> Option<([f32; 2], f32)> {
    let count = points.len() as f32;
    let mean = [0, 1].map(|axis| points.iter().map(|point| point.at_m[axis]).sum::<f32>() / count);
    let (mut xx, mut xy, mut yy) = (0.0_f32, 0.0_f32, 0.0_f32);
    for point in points {
        let [x, y] = [point.at_m[0] - mean[0], point.at_m[1] - mean[1]];
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let half = 0.5 * (xx - yy);
    let root = half.hypot(xy);
    if root <= f32::EPSILON {
        return None;
    }
    let smallest = (0.5 * (xx + yy) - root).max(0.0);
    let along = if half >= 0.0 { [half + root, xy] } else { [xy, root - half] };
    let length = along[0].hypot(along[1]);
    Some(([-along[1] / length, along[0] / length], (smallest / count).sqrt()))
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
