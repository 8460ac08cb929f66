//! A drive along a path: where the robot is at any time.
//!
//! Frame `map`: `base_link` at the start of the drive is the identity, so z = 0 is the floor there. Time 0 is
//! the start; before it and after the end the robot stands still. Corners are rounded by curves whose
//! curvature starts and ends at zero, the speed rises and falls at the path's acceleration and drops in
//! curves so that the turning rate is kept.

use crate::rig::drive::footing::{Footing, footings};
use crate::rig::drive::path_shape::{Point, distance, heading, round_corners, weave};
use crate::rng::Rng;
use crate::world::World;
use crate::world::path::{Path, PathError};
use crate::world::pose::Pose;
use crate::world::scene::Scene;
use crate::world::vec3::{Vec3, length};

mod footing;
pub mod odometry;
mod path_shape;

/// The longest drive, seconds.
const MAX_S: f64 = 86_400.0;
/// Swings that make up the shake; frequencies in Hz.
const SHAKE_HZ: [f64; 4] = [0.7, 1.3, 2.1, 3.4];

#[derive(Clone, Copy, Debug)]
struct Knot {
    along_m: f64,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    footing: Footing,
    time_s: f64,
    speed_m_s: f64,
}

/// A path with its times.
#[derive(Clone, Debug)]
pub struct Drive {
    knots: Vec<Knot>,
    map_from_world: Pose,
    cruise_m_s: f64,
    shake_rad: f64,
    /// Phases of roll and pitch, one a swing.
    shake_phase_rad: [[f64; 4]; 2],
}

/// Motion at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Where `base_link` is.
    pub map_from_base: Pose,
    /// Way since the start, meters.
    pub along_m: f64,
    /// Heading, not wrapped, radians.
    pub heading_rad: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Turning rate, counter-clockwise, rad/s.
    pub turn_rad_s: f64,
}

impl Drive {
    /// Plans the drive. `seed` moves nothing but the phases of the shake.
    pub fn new(path: &Path, seed: u64) -> Result<Self, PathError> {
        path.check()?;
        let way = weave(&round_corners(path)?, path);
        let start = way[0];
        let map_from_world =
            Pose::from_angles([start[0], start[1], path.floor_z_m], [0.0, 0.0, heading(&way, 0)]).inverse();
        let in_map: Vec<[f64; 2]> = way
            .iter()
            .map(|p| map_from_world.apply([p[0], p[1], path.floor_z_m]))
            .map(|p| [p[0], p[1]])
            .collect();
        let mut knots = lay_out(&in_map);
        set_times(&mut knots, path);
        let found_s = knots.last().map_or(0.0, |knot| knot.time_s);
        if found_s > MAX_S {
            return Err(PathError::TooSlow { found_s, max_s: MAX_S });
        }
        let mut rng = Rng::new(seed, 0x5AFE, 0);
        let shake_phase_rad = [0, 1].map(|_| [0; 4].map(|_| rng.between(0.0, std::f64::consts::TAU)));
        Ok(Self {
            knots,
            map_from_world,
            cruise_m_s: path.speed_m_s,
            shake_rad: path.shake_deg.to_radians(),
            shake_phase_rad,
        })
    }

    /// Plans the drive through a world, whose surfaces it returns in `map`.
    pub fn through(world: &World, path: &Path, seed: u64) -> Result<(Self, Scene), PathError> {
        let mut drive = Self::new(path, seed)?;
        let scene = Scene::new(world.mesh_for(path).moved(&drive.map_from_world));
        if path.follow_ground {
            drive.follow_ground(path, &scene)?;
        }
        Ok((drive, scene))
    }

    /// Puts the robot on the ground all along the way; the way over a ramp is longer than its floor plan.
    fn follow_ground(&mut self, path: &Path, scene: &Scene) -> Result<(), PathError> {
        let way: Vec<[f64; 3]> =
            self.knots.iter().map(|knot| [knot.x_m, knot.y_m, knot.heading_rad]).collect();
        let found = footings(&way, scene)?;
        let mut along_m = 0.0;
        for i in 0..self.knots.len() {
            if i > 0 {
                let [dx, dy] = [0, 1].map(|axis| way[i][axis] - way[i - 1][axis]);
                along_m += length([dx, dy, found[i].z_m - found[i - 1].z_m]);
            }
            (self.knots[i].along_m, self.knots[i].footing) = (along_m, found[i]);
            (self.knots[i].time_s, self.knots[i].speed_m_s) = (0.0, 0.0);
        }
        set_times(&mut self.knots, path);
        Ok(())
    }

    /// Where the world's own frame lies in `map`.
    #[must_use]
    pub fn map_from_world(&self) -> Pose {
        self.map_from_world
    }

    /// Time from the start to the end, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.time_s)
    }

    /// Length of the way, meters.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.along_m)
    }

    /// Where `base_link` is `time_s` after the start.
    #[must_use]
    pub fn pose(&self, time_s: f64) -> Pose {
        self.motion(time_s).map_from_base
    }

    /// Pose and speeds `time_s` after the start.
    #[must_use]
    pub fn motion(&self, time_s: f64) -> Motion {
        let time_s = time_s.clamp(0.0, self.duration_s());
        let next = self.knots.partition_point(|knot| knot.time_s <= time_s).clamp(1, self.knots.len() - 1);
        let (a, b) = (self.knots[next - 1], self.knots[next]);
        let step_s = b.time_s - a.time_s;
        let acceleration = (b.speed_m_s - a.speed_m_s) / step_s;
        let dt = time_s - a.time_s;
        let speed_m_s = a.speed_m_s + acceleration * dt;
        let along_m = a.along_m + (a.speed_m_s + 0.5 * acceleration * dt) * dt;
        let cell_m = b.along_m - a.along_m;
        let u = ((along_m - a.along_m) / cell_m).clamp(0.0, 1.0);
        let heading_rad = a.heading_rad + u * (b.heading_rad - a.heading_rad);
        let (roll, pitch) = self.shake(time_s, speed_m_s);
        let ground = a.footing.between(&b.footing, u);
        let (roll, pitch) = (roll + ground.roll_rad, pitch + ground.pitch_rad);
        let position: Vec3 = [a.x_m + u * (b.x_m - a.x_m), a.y_m + u * (b.y_m - a.y_m), ground.z_m];
        Motion {
            map_from_base: Pose::from_angles(position, [roll, pitch, heading_rad]),
            along_m,
            heading_rad,
            speed_m_s,
            turn_rad_s: (b.heading_rad - a.heading_rad) / cell_m * speed_m_s,
        }
    }

    /// Roll and pitch, radians: swings with unit variance in sum, growing with the speed.
    fn shake(&self, time_s: f64, speed_m_s: f64) -> (f64, f64) {
        if self.shake_rad == 0.0 {
            return (0.0, 0.0);
        }
        let swing = |phases: [f64; 4]| -> f64 {
            let sum: f64 = SHAKE_HZ
                .iter()
                .zip(phases)
                .map(|(hz, phase)| (std::f64::consts::TAU * hz * time_s + phase).sin())
                .sum();
            sum * (2.0 / SHAKE_HZ.len() as f64).sqrt() * self.shake_rad * speed_m_s / self.cruise_m_s
        };
        (swing(self.shake_phase_rad[0]), swing(self.shake_phase_rad[1]))
    }
}

/// Knots with way and heading; times are set later.
fn lay_out(way: &[Point]) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::with_capacity(way.len());
    for (i, point) in way.iter().enumerate() {
        let mut heading_rad = heading(way, i);
        let mut along_m = 0.0;
        if let Some(last) = knots.last() {
            along_m = last.along_m + distance([last.x_m, last.y_m], *point);
            // Not wrapped: a full round adds a full turn.
            let turn = heading_rad - last.heading_rad;
            heading_rad =
                last.heading_rad + turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        }
        let footing = Footing::default();
        let [x_m, y_m] = *point;
        knots.push(Knot { along_m, x_m, y_m, heading_rad, footing, time_s: 0.0, speed_m_s: 0.0 });
    }
    knots
}

/// The fastest speeds that keep cruise, turning rate and acceleration, with a stop at both ends; then the
/// times.
fn set_times(knots: &mut [Knot], path: &Path) {
    let turn_rad_s = path.turn_deg_s.to_radians();
    let last = knots.len() - 1;
    for i in 1..last {
        let turn = (knots[i + 1].heading_rad - knots[i - 1].heading_rad).abs();
        let step_m = knots[i + 1].along_m - knots[i - 1].along_m;
        knots[i].speed_m_s = path.speed_m_s.min(turn_rad_s * step_m / turn.max(1e-12));
    }
    let reachable = |from: &Knot, to: &Knot| {
        let step_m = (to.along_m - from.along_m).abs();
        (from.speed_m_s * from.speed_m_s + 2.0 * path.acceleration_m_s2 * step_m).sqrt().min(to.speed_m_s)
    };
    for i in 1..=last {
        knots[i].speed_m_s = reachable(&knots[i - 1], &knots[i]);
    }
    for i in (0..last).rev() {
        knots[i].speed_m_s = reachable(&knots[i + 1], &knots[i]);
    }
    for i in 1..=last {
        let mean = 0.5 * (knots[i - 1].speed_m_s + knots[i].speed_m_s);
        knots[i].time_s = knots[i - 1].time_s + (knots[i].along_m - knots[i - 1].along_m) / mean;
    }
}

#[cfg(test)]
mod tests {
    use super::Drive;
    use crate::world::path::{Path, PathError};
    use crate::world::pose::Pose;

    fn path(waypoints_m: &[[f64; 2]]) -> Path {
        Path { waypoints_m: waypoints_m.to_vec(), speed_m_s: 0.5, acceleration_m_s2: 0.25, ..Path::default() }
    }

    #[test]
    fn a_straight_drive_has_the_times_of_the_trapezoid() {
        // 2 s to speed up over 0.5 m, 9 m at 0.5 m/s in 18 s, 2 s to stop.
        let drive = Drive::new(&path(&[[3.0, 4.0], [3.0, 14.0]]), 1).expect("drives");
        assert!((drive.duration_s() - 22.0).abs() < 1e-6, "{}", drive.duration_s());
        for (time_s, x_m, speed) in
            [(-5.0, 0.0, 0.0), (1.0, 0.125, 0.25), (12.0, 5.5, 0.5), (21.0, 9.875, 0.25), (99.0, 10.0, 0.0)]
        {
            let motion = drive.motion(time_s);
            let p = motion.map_from_base.translation_m;
            assert!((p[0] - x_m).abs() < 1e-3 && p[1].abs() < 1e-9, "{time_s}: {p:?}");
            assert!((motion.speed_m_s - speed).abs() < 2e-3, "{time_s}: {}", motion.speed_m_s);
            assert!(motion.heading_rad.abs() < 1e-9);
        }
    }

    #[test]
    fn the_map_starts_at_the_start_of_the_drive() {
        let path = Path { floor_z_m: -3.0, ..path(&[[1.0, 2.0], [1.0, 5.0], [4.0, 5.0]]) };
        let drive = Drive::new(&path, 1).expect("drives");
        assert_eq!(drive.pose(0.0), Pose::planar(0.0, 0.0, 0.0));
        // The world's [1, 5] at the floor lies 3 m ahead.
        let ahead = drive.map_from_world().apply([1.0, 5.0, -3.0]);
        assert!((ahead[0] - 3.0).abs() < 1e-9 && ahead[1].abs() < 1e-9 && ahead[2].abs() < 1e-9, "{ahead:?}");
        let end = drive.pose(1e9);
        assert!((end.translation_m[0] - 3.0).abs() < 1e-9 && (end.translation_m[1] + 3.0).abs() < 1e-9);
        assert!((end.yaw_rad() + std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn the_drive_passes_its_waypoints_within_the_rounding() {
        let corners = [[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [1.0, 7.0], [0.0, 0.0]];
        let path = Path { corner_m: 0.8, ..path(&corners) };
        let drive = Drive::new(&path, 1).expect("drives");
        let steps = 20_000;
        for corner in corners {
            let nearest = (0..=steps)
                .map(|k| drive.pose(drive.duration_s() * f64::from(k) / f64::from(steps)).translation_m)
                .map(|p| (p[0] - corner[0]).hypot(p[1] - corner[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.4 * path.corner_m, "{corner:?} {nearest}");
        }
    }

    #[test]
    fn speed_turning_and_heading_stay_within_their_limits_and_agree_with_the_way() {
        let path = Path {
            weave_m: 0.1,
            turn_deg_s: 20.0,
            ..path(&[[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [12.0, 7.0]])
        };
        let drive = Drive::new(&path, 1).expect("drives");
        let dt = 0.01;
        let mut time_s = 0.0;
        while time_s + dt < drive.duration_s() {
            let (a, b) = (drive.motion(time_s), drive.motion(time_s + dt));
            let step: Vec<f64> =
                (0..2).map(|i| b.map_from_base.translation_m[i] - a.map_from_base.translation_m[i]).collect();
            let moved = step[0].hypot(step[1]);
            assert!(moved <= path.speed_m_s * dt * 1.001, "{time_s}: {moved}");
            assert!((b.heading_rad - a.heading_rad).abs() <= 20.1_f64.to_radians() * dt, "{time_s}");
            if moved > 1e-4 {
                let mean = 0.5 * (a.heading_rad + b.heading_rad);
                assert!((step[1].atan2(step[0]) - mean).abs() < 0.004, "{time_s}: {step:?} {mean}");
            }
            assert!(
                (b.speed_m_s - a.speed_m_s).abs() <= path.acceleration_m_s2 * dt * 1.3 + 2e-3,
                "{time_s}"
            );
            time_s += dt;
        }
    }

    #[test]
    fn the_shake_has_its_standard_deviation_and_stops_with_the_robot() {
        let path = Path { shake_deg: 0.15, ..path(&[[0.0, 0.0], [300.0, 0.0]]) };
        let drive = Drive::new(&path, 3).expect("drives");
        let n = 20_000;
        let rolls: Vec<f64> = (0..n)
            .map(|k| drive.pose(10.0 + f64::from(k) * 0.025))
            .map(|p| p.rotation[2][1].asin().to_degrees())
            .collect();
        let deviation = (rolls.iter().map(|r| r * r).sum::<f64>() / f64::from(n)).sqrt();
        assert!((deviation - 0.15).abs() < 0.01, "{deviation}");
        assert_eq!(drive.pose(0.0), Pose::default());
    }

    #[test]
    fn a_path_that_cannot_be_driven_says_why() {
        assert!(matches!(
            Drive::new(&path(&[[1.0, 1.0], [1.0, 1.0]]), 1),
            Err(PathError::TooShort { found: 1 })
        ));
        let back = path(&[[0.0, 0.0], [5.0, 0.0], [0.0, 0.0]]);
        assert!(matches!(Drive::new(&back, 1), Err(PathError::TooSharp { waypoint: 1, .. })));
        let far = path(&[[0.0, 0.0], [10_001.0, 0.0]]);
        assert!(matches!(Drive::new(&far, 1), Err(PathError::TooLong { .. })));
        let slow = Path { speed_m_s: 1e-6, ..path(&[[0.0, 0.0], [1.0, 0.0]]) };
        assert!(matches!(Drive::new(&slow, 1), Err(PathError::TooSlow { .. })));
    }
}
