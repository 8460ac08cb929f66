//! Recordings of a robot that drives twice around a ring of corridors: the truth, and poses that drift from it. Made without any device.
//!
//! The corridors are 2 m wide around a core of 14 m by 8 m, with niches of different widths in the outer walls.

use std::path::Path;

use biplane_matcher::Pose2;
use biplane_recording::msg::{LaserScan, Odometry, PoseWithCovarianceStamped, TfMessage, TransformStamped};
use biplane_recording::{Rig, Topic, Writer, WriterOptions};

const START_NS: i64 = 1_700_000_000_000_000_000;
/// Between two scans, metres.
const STEP_M: f64 = 0.12;

/// How a recording is made.
#[derive(Clone, Copy)]
pub struct Drive {
    /// Rounds, counter-clockwise; fractions count.
    pub rounds: f64,
    /// Where on the ring it begins, metres along it.
    pub from_m: f64,
    /// The recorded poses turn so much too far each metre, radians.
    pub drift_rad_per_m: f64,
    /// Another building: a third larger, with other niches.
    pub elsewhere: bool,
    /// Seed of the range noise.
    pub seed: u64,
}

impl Default for Drive {
    fn default() -> Self {
        Self { rounds: 2.0, from_m: 0.0, drift_rad_per_m: 0.002, elsewhere: false, seed: 1 }
    }
}

/// Walls as segments.
fn walls(elsewhere: bool) -> Vec<[f64; 4]> {
    let (w, h) = (16.0, 10.0);
    let mut walls =
        vec![[1.0, 1.0, 15.0, 1.0], [15.0, 1.0, 15.0, 9.0], [15.0, 9.0, 1.0, 9.0], [1.0, 9.0, 1.0, 1.0]];
    let corners = [[-1.0, -1.0], [w + 1.0, -1.0], [w + 1.0, h + 1.0], [-1.0, h + 1.0]];
    let niches: [&[[f64; 3]]; 4] = if elsewhere {
        [&[[1.0, 4.0, 3.0]], &[[6.0, 1.0, 0.5]], &[[2.0, 2.0, 1.5], [9.0, 5.0, 0.3]], &[[3.0, 3.0, 2.0]]]
    } else {
        [
            &[[3.0, 1.0, 0.5], [8.0, 2.0, 0.9], [13.0, 0.7, 0.4]],
            &[[2.0, 0.8, 0.3], [7.0, 1.5, 1.2]],
            &[[4.0, 2.5, 0.4], [11.0, 1.2, 1.0], [15.0, 0.6, 0.6]],
            &[[2.5, 1.1, 0.8], [6.0, 0.9, 0.4], [9.0, 1.0, 0.2]],
        ]
    };
    for side in 0..4 {
        let (a, b): ([f64; 2], [f64; 2]) = (corners[side], corners[(side + 1) % 4]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        // Outwards of a counter-clockwise ring is to the right.
        let at =
            |s: f64, out: f64| [a[0] + s * along[0] + out * along[1], a[1] + s * along[1] - out * along[0]];
        let mut line = vec![at(0.0, 0.0)];
        for [s, wide, deep] in niches[side] {
            line.extend([at(*s, 0.0), at(*s, *deep), at(s + wide, *deep), at(s + wide, 0.0)]);
        }
        line.push(at(length, 0.0));
        walls.extend(line.windows(2).map(|pair| [pair[0][0], pair[0][1], pair[1][0], pair[1][1]]));
    }
    walls
}

/// The pose on the ring after so many metres: around a rectangle of 16 m by 10 m with corners turned over a metre.
pub fn pose_at(way_m: f64) -> Pose2 {
    let raw = |way_m: f64| {
        let s = way_m.rem_euclid(52.0);
        match s {
            s if s < 16.0 => [s, 0.0],
            s if s < 26.0 => [16.0, s - 16.0],
            s if s < 42.0 => [16.0 - (s - 26.0), 10.0],
            s => [0.0, 10.0 - (s - 42.0)],
        }
    };
    let mean = |way_m: f64| {
        let sum = (-5..=5)
            .map(|k| raw(way_m + f64::from(k) * 0.12))
            .fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        sum.map(|value| value / 11.0)
    };
    let (here, ahead) = (mean(way_m), mean(way_m + 0.1));
    Pose2::new(here[0], here[1], (ahead[1] - here[1]).atan2(ahead[0] - here[0]))
}

fn range_m(walls: &[[f64; 4]], from: [f64; 2], angle_rad: f64) -> f64 {
    let (dy, dx) = angle_rad.sin_cos();
    let hit = |wall: &[f64; 4]| {
        let (ex, ey) = (wall[2] - wall[0], wall[3] - wall[1]);
        let (wx, wy) = (wall[0] - from[0], wall[1] - from[1]);
        let cross = dx * ey - dy * ex;
        let (range, part) = ((wx * ey - wy * ex) / cross, (wx * dy - wy * dx) / cross);
        (range > 0.0 && (0.0..=1.0).contains(&part)).then_some(range)
    };
    walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
}

fn quaternion(theta_rad: f64) -> [f64; 4] {
    let (sin, cos) = (theta_rad / 2.0).sin_cos();
    [0.0, 0.0, sin, cos]
}

/// Writes the recording, and returns the true poses in the frame of the first.
pub fn record(path: &Path, drive: Drive) -> Vec<Pose2> {
    let rig = Rig { vertical: None, ..Rig::default() };
    let mount = rig.horizontal.mount;
    let mut writer = Writer::create(path, &WriterOptions::default()).unwrap();
    writer.attach("rig.toml", "application/toml", rig.to_toml().as_bytes()).unwrap();
    let mut noise = drive.seed;
    let mut next = move || {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((noise >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.03
    };
    // A larger building is driven through at a larger step.
    let scale = if drive.elsewhere { 1.35 } else { 1.0 };
    let place = |way_m: f64| {
        let pose = pose_at(way_m / scale);
        Pose2::new(scale * pose.x_m, scale * pose.y_m, pose.theta_rad)
    };
    let walls: Vec<[f64; 4]> =
        walls(drive.elsewhere).into_iter().map(|wall| wall.map(|value| scale * value)).collect();
    let first = place(drive.from_m);
    let (mut truth, mut drifting): (Vec<Pose2>, Pose2) = (Vec::new(), Pose2::IDENTITY);
    for number in 0..(drive.rounds * 52.0 / STEP_M) as i64 {
        let stamp_ns = START_NS + number * 200_000_000;
        let here = place(drive.from_m + number as f64 * STEP_M);
        if let Some(last) = truth.last() {
            let mut step = (first * *last).between(&here);
            step.theta_rad += drive.drift_rad_per_m * step.distance_m();
            drifting = drifting * step;
        }
        truth.push(first.between(&here));
        let laser = here.transform([mount.x, mount.y]);
        let beam = |beam: usize| {
            let angle_rad = here.theta_rad + (beam as f64 - 90.0).to_radians();
            (range_m(&walls, laser, angle_rad) + next()) as f32
        };
        let scan = LaserScan {
            stamp_ns,
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: 1.0_f32.to_radians(),
            range_max_m: 80.0,
            ranges_m: (0..181).map(beam).collect(),
            ..LaserScan::default()
        };
        writer.write(Topic::ScanHorizontal, stamp_ns, stamp_ns, &scan).unwrap();
        write_poses(&mut writer, stamp_ns, &drifting);
    }
    writer.finish().unwrap();
    truth
}

fn write_poses(writer: &mut Writer, stamp_ns: i64, map_from_base: &Pose2) {
    let (position_m, rotation) =
        ([map_from_base.x_m, map_from_base.y_m, 0.0], quaternion(map_from_base.theta_rad));
    let odometry = Odometry { stamp_ns, position_m, orientation_xyzw: rotation, ..Odometry::default() };
    writer.write(Topic::Odom, stamp_ns, stamp_ns, &odometry).unwrap();
    let pose = PoseWithCovarianceStamped {
        stamp_ns,
        frame_id: "map".to_owned(),
        position_m,
        orientation_xyzw: rotation,
        ..PoseWithCovarianceStamped::default()
    };
    writer.write(Topic::Pose, stamp_ns, stamp_ns, &pose).unwrap();
    let frame = |frame: &str, child: &str, translation_m, rotation_xyzw| TransformStamped {
        stamp_ns,
        frame_id: frame.to_owned(),
        child_frame_id: child.to_owned(),
        translation_m,
        rotation_xyzw,
    };
    let still = [0.0, 0.0, 0.0, 1.0];
    let transforms =
        vec![frame("map", "odom", [0.0; 3], still), frame("odom", "base_link", position_m, rotation)];
    writer.write(Topic::Tf, stamp_ns, stamp_ns, &TfMessage { transforms }).unwrap();
}
