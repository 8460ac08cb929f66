//! A recording of a robot in an empty room, made without any device: the truth is a box.
//!
//! The room is 8 m long (x from -1 to 7), 4 m wide and 2.5 m high; the robot drives 5 m along its middle.

use std::path::Path;

use biplane_recording::msg::{LaserScan, Odometry, PoseWithCovarianceStamped};
use biplane_recording::rig::Laser;
use biplane_recording::{Rig, Topic, Writer, WriterOptions};

const LOW: [f64; 3] = [-1.0, -2.0, 0.0];
const HIGH: [f64; 3] = [7.0, 2.0, 2.5];
const SPEED_M_S: f64 = 0.25;
const DURATION_NS: i64 = 20_000_000_000;
const START_NS: i64 = 1_700_000_000_000_000_000;

/// What the recording holds.
#[derive(Clone, Copy)]
pub struct Content {
    /// Poses, as after matching.
    pub poses: bool,
    /// A vertical laser.
    pub vertical: bool,
}

/// Horizontal scans of a recording.
pub const HORIZONTAL_SCANS: usize = 101;

/// Distance from a point inside of the room to its walls along a direction.
fn range_m(from: [f64; 3], direction: [f64; 3]) -> f64 {
    (0..3)
        .filter(|&axis| direction[axis].abs() > 1e-12)
        .map(|axis| {
            if direction[axis] > 0.0 {
                (HIGH[axis] - from[axis]) / direction[axis]
            } else {
                (LOW[axis] - from[axis]) / direction[axis]
            }
        })
        .fold(f64::INFINITY, f64::min)
}

struct Noise(u64);

impl Noise {
    /// Evenly from -1 to 1 cm.
    fn next_m(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.02
    }
}

fn scan(laser: &Laser, frame: &str, stamp_ns: i64, noise: &mut Noise) -> LaserScan {
    let matrix = laser.mount.matrix();
    let range = |beam: usize| {
        let seconds = (stamp_ns + laser.beam_delay_ns(beam) - START_NS) as f64 * 1e-9;
        let [x, y, z] = laser.mount.translation_m();
        let (sin, cos) = laser.beam_angle_rad(beam).sin_cos();
        let direction = [0, 1, 2].map(|row: usize| matrix[row][0] * cos + matrix[row][1] * sin);
        (range_m([x + SPEED_M_S * seconds, y, z], direction) + noise.next_m()) as f32
    };
    let beams = laser.beam_count();
    LaserScan {
        stamp_ns,
        frame_id: frame.to_owned(),
        angle_min_rad: laser.beam_angle_rad(0) as f32,
        angle_max_rad: laser.beam_angle_rad(beams - 1) as f32,
        angle_increment_rad: laser.resolution_deg.to_radians() as f32,
        time_increment_s: laser.time_increment_s() as f32,
        scan_time_s: 0.2,
        range_min_m: 0.0,
        range_max_m: 80.0,
        ranges_m: (0..beams).map(range).collect(),
        intensities: Vec::new(),
    }
}

fn pose(stamp_ns: i64) -> PoseWithCovarianceStamped {
    let x_m = SPEED_M_S * (stamp_ns - START_NS) as f64 * 1e-9;
    PoseWithCovarianceStamped {
        stamp_ns,
        frame_id: "map".to_owned(),
        position_m: [x_m, 0.0, 0.0],
        ..PoseWithCovarianceStamped::default()
    }
}

/// Writes the recording.
pub fn record(path: &Path, content: Content) {
    let mut rig = Rig::default();
    if !content.vertical {
        rig.vertical = None;
    }
    let mut writer = Writer::create(path, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes()).unwrap();
    let mut noise = Noise(1);
    // Horizontal scans every 200 ms, vertical scans every 80 ms.
    for tick in 0..=DURATION_NS / 40_000_000 {
        let stamp_ns = START_NS + tick * 40_000_000;
        if tick % 5 == 0 {
            let message = scan(&rig.horizontal, "laser_horizontal", stamp_ns, &mut noise);
            writer.write(Topic::ScanHorizontal, stamp_ns, stamp_ns, &message).unwrap();
            let odometry =
                Odometry { stamp_ns, position_m: pose(stamp_ns).position_m, ..Odometry::default() };
            writer.write(Topic::Odom, stamp_ns, stamp_ns, &odometry).unwrap();
            if content.poses {
                writer.write(Topic::Pose, stamp_ns, stamp_ns, &pose(stamp_ns)).unwrap();
            }
        }
        if let Some(laser) = rig.vertical.as_ref().filter(|_| tick % 2 == 0) {
            let message = scan(laser, "laser_vertical", stamp_ns, &mut noise);
            writer.write(Topic::ScanVertical, stamp_ns, stamp_ns, &message).unwrap();
            if content.poses {
                writer.write(Topic::PoseVertical, stamp_ns, stamp_ns, &pose(stamp_ns)).unwrap();
            }
        }
    }
    writer.finish().unwrap();
}
