//! What is seen so far: scans with their poses, put together into the floor map and the sheet of points.
//!
//! Scans come before their poses; both carry the scan's stamp. A scan is placed whole at the pose of its
//! stamp: what the robot moves in the 13 ms of a scan is of no account to the eye (`biplane build` places
//! each beam at its own time).

#[cfg(feature = "live")]
pub(crate) mod grid;
#[cfg(feature = "live")]
pub(crate) mod point_accumulator;

use biplane_geometry::PortableMath;
use std::collections::VecDeque;

use biplane_recording::messages::{LaserScan, Message, PoseWithCovarianceStamped};
use biplane_recording::rig::Mount;
use biplane_recording::{Rig, Topic};

use crate::live::scene::grid::FloorGrid;
use crate::live::scene::point_accumulator::PointAccumulator;
use crate::output::message_ring::Head;

/// Scans of a laser that may wait for their poses: the oldest goes when there are more.
const MAX_WAITING: usize = 64;
/// The floor map takes beams up to here, meters: what glass and mirrors make beyond would only widen it.
const FLOOR_RANGE_M: f64 = 30.0;
/// The floor map learns again when the base has moved so far (meters), turned so far (radians), or after so
/// long (nanoseconds).
const STEP: (f64, f64, i64) = (0.05, 0.05, 1_000_000_000);

/// Floor map and sheet, and what is needed to go on with them.
#[derive(Debug)]
pub(crate) struct Scene {
    /// The floor map.
    pub grid: FloorGrid,
    /// The points of the vertical laser.
    pub point_accumulator: PointAccumulator,
    horizontal: Waiting,
    vertical: Option<Waiting>,
    /// Where and when the floor map learned last: x, y, heading, stamp.
    learned: Option<([f64; 3], i64)>,
    ends_m: Vec<([f64; 2], bool)>,
}

/// A laser whose scans wait for poses.
#[derive(Debug)]
struct Waiting {
    mount: Mount,
    scans: VecDeque<LaserScan>,
}

/// A scan and the pose of `base_link` in `map` at its stamp: x, y in meters, heading in radians.
struct Placed {
    scan: LaserScan,
    map_from_base: [f64; 3],
    mount: Mount,
}

impl Scene {
    /// An empty one, of lasers with the mounts of this rig.
    pub(crate) fn new(rig: &Rig) -> Self {
        let waiting = |mount: &Mount| Waiting { mount: *mount, scans: VecDeque::new() };
        Self {
            grid: FloorGrid::default(),
            point_accumulator: PointAccumulator::default(),
            horizontal: waiting(&rig.horizontal.mount),
            vertical: rig.vertical.as_ref().map(|laser| waiting(&laser.mount)),
            learned: None,
            ends_m: Vec::new(),
        }
    }

    /// Takes a message of the recording; one that it has no use for changes nothing.
    pub(crate) fn take(&mut self, head: &Head, cdr: &[u8]) {
        match head.topic {
            Topic::ScanHorizontal => self.horizontal.push(cdr),
            Topic::ScanVertical => {
                if let Some(vertical) = &mut self.vertical {
                    vertical.push(cdr);
                }
            }
            Topic::Pose => {
                if let Some(placed) = self.horizontal.place(cdr) {
                    self.add_floor(&placed);
                }
            }
            Topic::PoseVertical => {
                let placed = self.vertical.as_mut().and_then(|vertical| vertical.place(cdr));
                for point_m in placed.iter().flat_map(|placed| placed.ends_m(f64::INFINITY)) {
                    self.point_accumulator.add(point_m.0.map(|coordinate| coordinate as f32));
                }
            }
            _ => {}
        }
    }

    fn add_floor(&mut self, placed: &Placed) {
        let ([x, y, heading], stamp_ns) = (placed.map_from_base, placed.scan.stamp_ns);
        let stays = self.learned.is_some_and(|([x0, y0, heading0], ns)| {
            let turned = (heading - heading0).portable_sin().abs();
            (x - x0).portable_hypot(y - y0) < STEP.0
                && turned < STEP.1
                && (0..STEP.2).contains(&(stamp_ns - ns))
        });
        if stays {
            return;
        }
        self.learned = Some((placed.map_from_base, stamp_ns));
        self.ends_m.clear();
        self.ends_m.extend(placed.ends_m(FLOOR_RANGE_M).map(|([x, y, _], is_end)| ([x, y], is_end)));
        let [x, y, _] = placed.map_from_laser([0.0; 3]);
        self.grid.add([x, y], &self.ends_m);
    }
}

impl Waiting {
    fn push(&mut self, cdr: &[u8]) {
        let Ok(scan) = LaserScan::decode(cdr) else { return };
        if self.scans.len() >= MAX_WAITING {
            self.scans.pop_front();
        }
        self.scans.push_back(scan);
    }

    /// The scan that a pose is of. Those before it will not get one any more.
    fn place(&mut self, cdr: &[u8]) -> Option<Placed> {
        let pose = PoseWithCovarianceStamped::decode(cdr).ok()?;
        let place = self.scans.iter().position(|scan| scan.stamp_ns == pose.stamp_ns)?;
        let scan = self.scans.drain(..=place).next_back()?;
        let [x, y, _] = pose.position_m;
        let [_, _, sin, cos] = pose.orientation_xyzw;
        Some(Placed { scan, map_from_base: [x, y, 2.0 * sin.portable_atan2(cos)], mount: self.mount })
    }
}

impl Placed {
    /// A point of the laser's frame in `map`, meters.
    fn map_from_laser(&self, point_in_laser_m: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.mount.base_from_laser(point_in_laser_m);
        let [base_x, base_y, heading] = self.map_from_base;
        let (sin, cos) = heading.portable_sin_cos();
        [base_x + cos * x - sin * y, base_y + sin * x + cos * y, z]
    }

    /// Where its beams go to in `map`, at most so far, meters, and whether they end there. Beams without an
    /// end are left out.
    fn ends_m(&self, max_m: f64) -> impl Iterator<Item = ([f64; 3], bool)> {
        let scan = &self.scan;
        let valid = scan.range_min_m..=scan.range_max_m;
        let beams = scan.ranges_m.iter().enumerate().filter(move |(_, range_m)| valid.contains(*range_m));
        beams.map(move |(beam, &range_m)| {
            let angle_rad = f64::from(scan.angle_min_rad) + beam as f64 * f64::from(scan.angle_increment_rad);
            let (sin, cos) = angle_rad.portable_sin_cos();
            let length_m = f64::from(range_m).min(max_m);
            (self.map_from_laser([length_m * cos, length_m * sin, 0.0]), f64::from(range_m) <= max_m)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_recording::topics::FRAME_MAP;

    const MS: i64 = 1_000_000;

    /// A fan of one valid beam straight ahead, between two that are none.
    fn scan(stamp_ns: i64, range_m: f32) -> Vec<u8> {
        let scan = LaserScan {
            stamp_ns,
            angle_min_rad: -0.5,
            angle_increment_rad: 0.5,
            range_max_m: 80.0,
            ranges_m: vec![f32::INFINITY, range_m, f32::NAN],
            ..LaserScan::default()
        };
        let mut cdr = Vec::new();
        scan.encode(&mut cdr);
        cdr
    }

    fn pose(stamp_ns: i64, x: f64, y: f64, heading: f64) -> Vec<u8> {
        let (sin, cos) = (heading / 2.0_f64).sin_cos();
        let pose = PoseWithCovarianceStamped {
            stamp_ns,
            frame_id: FRAME_MAP.to_owned(),
            position_m: [x, y, 0.0],
            orientation_xyzw: [0.0, 0.0, sin, cos],
            covariance: [0.0; 36],
        };
        let mut cdr = Vec::new();
        pose.encode(&mut cdr);
        cdr
    }

    fn scene() -> Scene {
        let mut rig = Rig::default();
        rig.horizontal.mount = Mount { x: 0.2, ..Mount::default() };
        // Its middle beam points up.
        rig.vertical.as_mut().unwrap().mount = Mount { x: 0.1, z: 0.4, pitch: -90.0, ..Mount::default() };
        Scene::new(&rig)
    }

    fn take(scene: &mut Scene, topic: Topic, cdr: &[u8]) {
        scene.take(&Head { topic, log_time_ns: 0, publish_time_ns: 0 }, cdr);
    }

    #[test]
    fn a_vertical_scan_comes_to_where_its_own_pose_and_mount_put_it() {
        let mut scene = scene();
        take(&mut scene, Topic::ScanVertical, &scan(10 * MS, 2.0));
        take(&mut scene, Topic::ScanVertical, &scan(20 * MS, 1.0));
        take(&mut scene, Topic::ScanVertical, &scan(30 * MS, 3.0));
        take(&mut scene, Topic::PoseVertical, &pose(15 * MS, 9.0, 9.0, 0.0)); // of no scan
        assert_eq!(scene.point_accumulator.len(), 0);
        take(&mut scene, Topic::PoseVertical, &pose(20 * MS, 1.0, 2.0, std::f64::consts::FRAC_PI_2));
        // 0.1 m ahead of the base, which looks along y; a meter above the laser.
        let [x, y, z] = scene.point_accumulator.from(0, 9)[0];
        assert!((x - 1.0).abs() < 1e-6 && (y - 2.1).abs() < 1e-6 && (z - 1.4).abs() < 1e-6, "{x} {y} {z}");
        take(&mut scene, Topic::PoseVertical, &pose(10 * MS, 0.0, 0.0, 0.0)); // too late
        assert_eq!(scene.point_accumulator.len(), 1);
        take(&mut scene, Topic::PoseVertical, &pose(30 * MS, 0.0, 0.0, 0.0));
        assert_eq!(scene.point_accumulator.len(), 2);
    }

    #[test]
    fn the_floor_map_grows_while_the_base_moves_and_seldom_while_it_stands() {
        let mut scene = scene();
        for step in 0..100_i64 {
            let x = 0.02 * step.min(50) as f64;
            take(&mut scene, Topic::ScanHorizontal, &scan(step * 100 * MS, 4.0));
            take(&mut scene, Topic::Pose, &pose(step * 100 * MS, x, 0.0, 0.0));
        }
        // A meter in steps of 6 cm (three of 2 cm), then five seconds at rest.
        assert!((15..=26).contains(&scene.grid.version()), "{}", scene.grid.version());
        let map = scene.grid.message();
        assert!(
            map.cells.iter().any(|&cell| cell > 50) && map.cells.iter().any(|&cell| (0..50).contains(&cell))
        );
    }

    #[test]
    fn scans_that_get_no_pose_do_not_pile_up_and_garbage_is_passed_over() {
        let mut scene = scene();
        for step in 0..1000 {
            take(&mut scene, Topic::ScanHorizontal, &scan(step, 4.0));
        }
        assert_eq!(scene.horizontal.scans.len(), MAX_WAITING);
        take(&mut scene, Topic::ScanHorizontal, &[1, 2, 3]);
        take(&mut scene, Topic::Pose, &[]);
        assert_eq!(scene.grid.version(), 0);
    }
}
