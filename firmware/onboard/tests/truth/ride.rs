//! A simulated drive given to the tracker scan by scan: exact ranges once, noise and odometry by seed, no
//! bytes in between.
//!
//! Scenes, scanner and drive are the simulator's, which shares no code with the matcher. The ranges without
//! noise are taken once a ride; each run adds noise, rounds to centimeters as the laser does, and makes up
//! its own odometry. Frame: `map`, the base at the start. Units: meters, radians, seconds.

use biplane_matcher::{Beam, Pose2, Scan, Tracked, Tracker, TrackerParams};
use biplane_mock::rig::drive::Drive;
use biplane_mock::rig::scanner::{LARGEST_VALUE, Scanner, ScannerParams, TURN_NS, Variant};
use biplane_mock::rng::Rng;
use biplane_mock::world::World;
use biplane_mock::world::built_in::builder::{Builder, Facing};
use biplane_mock::world::path::Path;
use biplane_mock::world::pose::Pose;

/// The laser's place on the base, meters ahead.
const AHEAD_M: f64 = 0.2;
/// One scan in so many mirror turns: 9.4 Hz.
const EVERY_TURNS: i64 = 8;
/// Standard deviation of a range, meters.
const RANGE_NOISE_M: f64 = 0.015;

/// A moment at which a scan begins.
pub(crate) struct Moment {
    time_s: f64,
    /// Where the base is.
    pub truth: Pose2,
    twist: [f64; 3],
    ranges_m: Vec<f32>,
    /// How far it has driven.
    pub path_m: f64,
}

/// A way through a world, seen without noise.
pub(crate) struct Ride {
    /// The world's name.
    pub name: &'static str,
    /// Scan by scan.
    pub moments: Vec<Moment>,
}

/// A corridor as wide as the furnished one, without anything in it, whose ends no beam reaches.
pub(crate) fn bare_corridor(length_m: f64) -> World {
    let mut builder = Builder::default();
    let along = [-120.0, length_m + 120.0];
    builder.rect(Facing::Left, -1.08, along, [0.0, 2.7], &[]);
    builder.rect(Facing::Right, 1.12, along, [0.0, 2.7], &[]);
    let path = Path {
        name: "along".to_owned(),
        waypoints_m: vec![[0.0, 0.0], [length_m, 0.0]],
        speed_m_s: 0.5,
        weave_m: 0.07,
        weave_length_m: 4.0,
        ..Path::default()
    };
    let (mesh, rounds) = builder.finish_all();
    World { name: "bare".to_owned(), mesh, rounds, objects: Vec::new(), plan: None, paths: vec![path] }
}

impl Ride {
    /// Drives the path so many times, every second time in reverse.
    pub(crate) fn new(name: &'static str, world: &World, path: &Path, legs: u32) -> Self {
        let (drive, scene) = Drive::through(world, path, 1).unwrap();
        let there_s = drive.duration_s();
        let end_s = there_s * f64::from(legs);
        let is_back = |time_s: f64| (time_s / there_s) as i64 % 2 == 1;
        let folded_s = |time_s: f64| {
            let since_s = time_s % there_s;
            if is_back(time_s) { there_s - since_s } else { since_s }
        };
        let map_from_base = |ns: i64| -> Pose { drive.pose(folded_s(ns as f64 * 1e-9)) };
        let scanner = Scanner {
            scene: &scene,
            map_from_base: &map_from_base,
            base_from_laser: Pose::from_angles([AHEAD_M, 0.0, 0.3], [0.0; 3]),
            params: ScannerParams { sigma_m: 0.0, ..ScannerParams::default() },
        };
        let variant = Variant::new(180, 100).unwrap();
        let scans = (end_s * 1e9) as i64 / (EVERY_TURNS * TURN_NS);
        let moment = |scan: i64| {
            let time_ns = scan * EVERY_TURNS * TURN_NS;
            let time_s = time_ns as f64 * 1e-9;
            let motion = drive.motion(folded_s(time_s));
            let sign = if is_back(time_s) { -1.0 } else { 1.0 };
            let legs_before = (time_s / there_s).floor();
            let since_m = if is_back(time_s) { drive.length_m() - motion.along_m } else { motion.along_m };
            let path_m = legs_before * drive.length_m() + since_m;
            let [x_m, y_m, _] = motion.map_from_base.translation_m;
            let words = scanner.scan(time_ns, variant, true, &mut Rng::new(1, 0, scan));
            let range_m =
                |word: &u16| if *word > LARGEST_VALUE { f32::INFINITY } else { f32::from(*word) * 0.001 };
            Moment {
                time_s,
                truth: Pose2::new(x_m, y_m, motion.map_from_base.yaw_rad()),
                twist: [sign * motion.speed_m_s, 0.0, sign * motion.turn_rad_s],
                ranges_m: words.iter().map(range_m).collect(),
                path_m,
            }
        };
        Self { name, moments: (0..scans).map(moment).collect() }
    }

    /// Tracks it with noise and odometry of a seed, and with what is in the beams' way.
    pub(crate) fn run(
        &self,
        params: TrackerParams,
        odometry: &Odometry,
        way: InTheWay,
        seed: u64,
    ) -> Vec<Step> {
        let mut tracker = Tracker::new(params);
        let mut ranges = Rng::new(seed, 7, 0);
        let mut slips = Rng::new(seed, 8, 0);
        let mut odom_from_base = Pose2::IDENTITY;
        let mut last = &self.moments[0];
        let mut steps = Vec::with_capacity(self.moments.len());
        for moment in &self.moments {
            odom_from_base = odom_from_base * odometry.step(last, moment, &mut slips);
            last = moment;
            let beams: Vec<Beam> = moment.beams(way, &mut ranges).collect();
            let scan = Scan {
                stamp_ns: (moment.time_s * 1e9) as i64,
                laser_in_base_m: [AHEAD_M, 0.0],
                beams: &beams,
                twist_in_base: moment.twist,
            };
            steps.push(Step { tracked: tracker.track(&scan, Some(odom_from_base)), odom_from_base });
        }
        steps
    }
}

/// What keeps beams from the walls.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InTheWay {
    /// So many people walk to and fro.
    pub people: u32,
    /// Share of the beams that end anywhere before what they should meet: dust, rain, glare.
    pub short_share: f64,
    /// Every 6 m the base leans forward for half a meter, as over a door sill, and the laser sees the floor.
    pub leans: bool,
}

/// What the tracker made of a moment.
pub(crate) struct Step {
    /// The pose.
    pub tracked: Tracked,
    /// What the odometry said.
    pub odom_from_base: Pose2,
}

impl Moment {
    /// The beams with noise, in whole centimeters, as far as they pass.
    fn beams<'a>(&'a self, way: InTheWay, rng: &'a mut Rng) -> impl Iterator<Item = Beam> + 'a {
        self.ranges_m.iter().zip(-90_i32..).map(move |(&range_m, degrees)| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let person_m =
                (0..way.people).map(|number| self.person_m(number, [cos, sin])).fold(f64::INFINITY, f64::min);
            let falls_short = way.short_share > 0.0 && rng.unit() < way.short_share;
            let max_m = f64::from(range_m).min(20.0);
            let ends_m = if falls_short { rng.between(0.3, max_m) } else { f64::from(range_m) };
            let floor_m = if way.leans { self.floor_m(cos) } else { f64::INFINITY };
            let noisy_m = ends_m.min(person_m).min(floor_m) + RANGE_NOISE_M * rng.normal();
            let delay_s = f64::from(degrees + 90) / 360.0 * TURN_NS as f64 * 1e-9;
            Beam {
                direction_in_base: [cos as f32, sin as f32],
                range_m: ((noisy_m * 100.0).round() / 100.0) as f32,
                delay_s: delay_s as f32,
            }
        })
    }

    /// How far a beam gets to the floor: 3 to 5 m ahead of a base that leans by 3.5 to 5.5 degrees.
    fn floor_m(&self, cos: f64) -> f64 {
        const LASER_HEIGHT_M: f64 = 0.3;
        let leaning = (self.path_m - 3.0).rem_euclid(6.0) / 0.5;
        if self.path_m < 3.0 || leaning > 1.0 || cos <= 0.0 {
            return f64::INFINITY;
        }
        let pitch_rad = (3.5 + 2.0 * (std::f64::consts::PI * leaning).sin()).to_radians();
        LASER_HEIGHT_M / (pitch_rad.sin() * cos)
    }

    /// The share of the beams that end at people.
    pub(crate) fn hidden(&self, people: u32) -> f64 {
        let is_hidden = |(&range_m, degrees): (&f32, i32)| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            (0..people).any(|number| self.person_m(number, [cos, sin]) < f64::from(range_m))
        };
        let hidden = self.ranges_m.iter().zip(-90_i32..).filter(|beam| is_hidden(*beam)).count();
        hidden as f64 / self.ranges_m.len() as f64
    }

    /// How far a beam gets to a person, half a meter thick, who walks to and fro along the first 10 m at
    /// either wall, at up to 1.2 m/s; infinite when it passes.
    fn person_m(&self, number: u32, [cos, sin]: [f64; 2]) -> f64 {
        const RADIUS_M: f64 = 0.25;
        let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        let aside_m = 0.75 * side;
        let along_m = 5.0 + 5.0 * (0.24 * self.time_s + 2.1 * f64::from(number)).sin();
        let laser = self.truth * Pose2::new(AHEAD_M, 0.0, 0.0);
        let seen = laser.between(&Pose2::new(along_m, aside_m, 0.0));
        let (ahead_m, off_m) = (seen.x_m * cos + seen.y_m * sin, seen.x_m * sin - seen.y_m * cos);
        let depth = RADIUS_M * RADIUS_M - off_m * off_m;
        if depth > 0.0 && ahead_m > 0.3 { ahead_m - depth.sqrt() } else { f64::INFINITY }
    }
}

/// Odometry that is wrong.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Odometry {
    /// Share by which lengths are too long.
    pub scale: f64,
    /// Share by which turns are too large.
    pub turn: f64,
    /// Steady turn to one side, radians per meter.
    pub drift_rad_per_m: f64,
    /// Random walk along the way after a meter, meters.
    pub path_noise_m: f64,
    /// The same of the heading, radians.
    pub heading_noise_rad: f64,
}

impl Odometry {
    /// A poor one: 1.2 % long and 0.6 degrees a meter off.
    pub(crate) fn poor() -> Self {
        Self {
            scale: 0.012,
            turn: 0.01,
            drift_rad_per_m: 0.6_f64.to_radians(),
            path_noise_m: 0.005,
            heading_noise_rad: 0.4_f64.to_radians(),
        }
    }

    /// As wrong as the parameters of the covariance say, drawn by a seed.
    pub(crate) fn drawn(params: &TrackerParams, seed: u64) -> Self {
        let mut rng = Rng::new(seed, 99, 0);
        let pose_covariance = &params.pose_covariance;
        Self {
            scale: pose_covariance.scale_share * rng.normal(),
            turn: pose_covariance.turn_share * rng.normal(),
            drift_rad_per_m: pose_covariance.drift_rad_per_m * rng.normal(),
            path_noise_m: pose_covariance.way_m_per_root_m,
            heading_noise_rad: pose_covariance.heading_rad_per_root_m,
        }
    }

    fn step(&self, from: &Moment, to: &Moment, rng: &mut Rng) -> Pose2 {
        let step = from.truth.between(&to.truth);
        let path_m = to.path_m - from.path_m;
        let turn_rad = step.theta_rad * (1.0 + self.turn)
            + self.drift_rad_per_m * path_m
            + rng.normal() * self.heading_noise_rad * path_m.sqrt();
        let slip_m = rng.normal() * self.path_noise_m * path_m.sqrt();
        Pose2::new(step.x_m * (1.0 + self.scale) + slip_m, step.y_m * (1.0 + self.scale), turn_rad)
    }
}
