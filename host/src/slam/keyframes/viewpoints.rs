//! From where the scans of a submap looked, and in which directions: whether it could have seen a surface.
//!
//! A laser that looks ahead only never sees the far sides of what it drives past. Who comes back the other
//! way sees nothing but these. Frame of the submap, meters.

use biplane_geometry::vec2::{dot, minus, norm};
use biplane_matcher::{EndPoint, Placement, Pose2};

use crate::slam::keyframes::Node;

/// Scans that are asked: every so many.
const EVERY_NODE: usize = 2;
/// The directions around a laser are kept in so many sectors.
const SECTORS: u32 = 32;
/// A surface seen at a smaller angle than this is hardly seen: its sine.
const GRAZING_SINE: f32 = 0.1;

/// Where a laser was.
#[derive(Clone, Copy, Debug)]
struct Viewpoint {
    laser_m: [f32; 2],
    /// The base's direction ahead.
    ahead: [f32; 2],
}

/// See the module's text.
#[derive(Clone, Debug, Default)]
pub(crate) struct Viewpoints {
    places: Vec<Viewpoint>,
    /// The sectors in which anything was seen, a bit each.
    sectors: u32,
    /// How far anything was seen, meters.
    farthest_m: f32,
}

impl Viewpoints {
    /// Those of nodes at these poses.
    pub(crate) fn new(nodes: &[Node], poses: &[Pose2]) -> Self {
        let mut viewpoints = Self::default();
        for (node, pose) in nodes.iter().zip(poses).step_by(EVERY_NODE) {
            let scan = &node.keyframe_scan;
            let placement = Placement::new(pose);
            let laser_m = placement.place(scan.laser_m);
            let ahead = minus(placement.place([scan.laser_m[0] + 1.0, scan.laser_m[1]]), laser_m);
            viewpoints.places.push(Viewpoint { laser_m, ahead });
            for point in &scan.points {
                let offset_m = minus(point.at_m, scan.laser_m);
                viewpoints.sectors |= 1 << sector(offset_m);
                viewpoints.farthest_m = viewpoints.farthest_m.max(norm(offset_m));
            }
        }
        viewpoints
    }

    /// Whether a scan looked at where a point lies, from the side that its surface faces. Whether anything
    /// stood between is not asked.
    pub(crate) fn looked_at(&self, point: &EndPoint) -> bool {
        self.places.iter().any(|place| {
            let offset_m = minus(point.at_m, place.laser_m);
            let away_m = norm(offset_m);
            let faces = !point.has_normal() || -dot(point.normal, offset_m) > GRAZING_SINE * away_m;
            let left = [-place.ahead[1], place.ahead[0]];
            let from_base = [dot(offset_m, place.ahead), dot(offset_m, left)];
            faces && away_m <= self.farthest_m && self.sectors & (1 << sector(from_base)) != 0
        })
    }
}

/// The sector of a direction: along the sides of a square on its corner, which needs no angle.
fn sector([x, y]: [f32; 2]) -> u32 {
    let around = (x.abs() + y.abs()).max(f32::MIN_POSITIVE);
    let quarters = match (x >= 0.0, y >= 0.0) {
        (true, true) => y / around,
        (false, true) => 1.0 - x / around,
        (false, false) => 2.0 - y / around,
        (true, false) => 3.0 + x / around,
    };
    ((quarters * (SECTORS / 4) as f32) as u32).min(SECTORS - 1)
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{EndPoint, Pose2};

    use super::{SECTORS, Viewpoints, sector};
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;

    fn point(at_m: [f32; 2], normal: [f32; 2]) -> EndPoint {
        EndPoint { at_m, normal, weight: 1.0, ..EndPoint::default() }
    }

    /// Of a laser that looks half around, from 2 m ahead of the base, up to 5 m; the base is at (10, 0) and
    /// looks along -x.
    fn looking_back() -> Viewpoints {
        let ring = (-90..=90).map(|degrees| f64::from(degrees).to_radians());
        let points = ring.map(|rad| point([2.0 + 5.0 * rad.cos() as f32, 5.0 * rad.sin() as f32], [0.0; 2]));
        let keyframe_scan = KeyframeScan { points: points.collect(), laser_m: [2.0, 0.0] };
        let pose = Pose2::new(10.0, 0.0, std::f64::consts::PI);
        Viewpoints::new(&[Node::at(pose, keyframe_scan)], &[pose])
    }

    #[test]
    fn a_laser_looks_at_what_faces_it_where_it_looks_and_as_far_as_it_sees() {
        let viewpoints = looking_back();
        let cases = [
            ("ahead and facing it", point([5.0, 0.5], [1.0, 0.0]), true),
            ("ahead, the far side", point([5.0, 0.5], [-1.0, 0.0]), false),
            ("a wall along the way", point([5.0, 1.2], [0.0, -1.0]), true),
            ("the other side of that wall", point([5.0, 1.2], [0.0, 1.0]), false),
            ("behind it", point([9.5, 0.5], [-1.0, 0.0]), false),
            ("too far away", point([2.5, 0.5], [1.0, 0.0]), false),
            ("of no direction", point([5.0, 0.5], [0.0, 0.0]), true),
        ];
        for (what, point, is_looked_at) in cases {
            assert_eq!(viewpoints.looked_at(&point), is_looked_at, "{what}");
        }
    }

    #[test]
    fn sectors_go_once_around() {
        let around = (0..360).map(|degrees| f64::from(degrees).to_radians());
        let sectors: Vec<u32> =
            around.map(|rad| sector([10.0 * rad.cos() as f32, 10.0 * rad.sin() as f32])).collect();
        assert!(sectors.is_sorted(), "{sectors:?}");
        assert_eq!((sectors[0], sectors[359]), (0, SECTORS - 1));
        assert_eq!(sector([0.0, 0.0]), 0);
        assert_eq!(sector([f32::NAN, 1.0]), 0);
    }
}
