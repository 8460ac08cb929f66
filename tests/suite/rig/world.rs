//! A world that costs next to nothing: the walls of a room, computed, and a robot that drives to and fro in
//! it.
//!
//! Each scan has its own noise, so that no two telegrams are the same bytes. Meters; nanoseconds on the
//! device's clock.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use biplane_mock::devices::inertial::feed::InertialFeed;
use biplane_mock::devices::lms::scans::feed::Timeline;
use biplane_mock::rig::inertial::InertialSample;
use biplane_mock::rig::source::{OdometrySample, OdometrySource, ScanSource, ScanWords};
use biplane_mock::rng::Rng;

/// Walls of the room, seen from its middle: ahead, behind, left, right.
const WALLS_M: [f64; 4] = [6.0, 4.0, 2.2, 1.8];
/// The robot drives so far from the middle, and back.
const PATH_M: f64 = 2.0;
/// Its speed.
const SPEED_M_S: f64 = 0.4;

/// Time on a device's clock is time in the world.
pub(crate) struct SameTime;

impl Timeline for SameTime {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

/// How far ahead of the middle the robot is.
#[must_use]
pub(crate) fn path_m(t_ns: i64) -> f64 {
    let driven_m = t_ns.max(0) as f64 * 1e-9 * SPEED_M_S;
    PATH_M - (driven_m.rem_euclid(4.0 * PATH_M) - 2.0 * PATH_M).abs()
}

/// Sine and cosine of each beam's direction.
type BeamAngles = Vec<(f64, f64)>;

/// A laser in the room, on the robot's middle.
pub(crate) struct Room {
    seed: u64,
    stream: u64,
    /// Directions of the beams of a variant, computed once.
    fans: Vec<((u16, u16), BeamAngles)>,
}

impl Room {
    /// A laser with its own noise.
    #[must_use]
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self { seed, stream, fans: Vec::new() }
    }

    fn fan(&mut self, fov_deg: u16, resolution_cdeg: u16) -> &[(f64, f64)] {
        let key = (fov_deg, resolution_cdeg);
        if !self.fans.iter().any(|(of, _)| *of == key) {
            let step_deg = f64::from(resolution_cdeg) / 100.0;
            let count = usize::from(fov_deg) * 100 / usize::from(resolution_cdeg.max(1)) + 1;
            let beams = (0..count).map(|beam| {
                let (sin, cos) = (beam as f64 * step_deg - f64::from(fov_deg) / 2.0).to_radians().sin_cos();
                (sin, cos)
            });
            self.fans.push((key, beams.collect()));
        }
        self.fans.iter().find(|(of, _)| *of == key).map_or(&[], |(_, beams)| beams)
    }

    /// Value words of the beams of a variant from one on, each so many.
    fn words(
        &mut self,
        t0_ns: i64,
        (fov_deg, resolution_cdeg): (u16, u16),
        (first, step): (usize, usize),
        mm: bool,
    ) -> ScanWords {
        let mut rng = Rng::new(self.seed, 0x0C0A + self.stream, t0_ns);
        let [ahead, behind, left, right] = WALLS_M;
        let (to_front, to_back) = (ahead - path_m(t0_ns), behind + path_m(t0_ns));
        let units = if mm { 1000.0 } else { 100.0 };
        let beams = self.fan(fov_deg, resolution_cdeg).iter().skip(first).step_by(step);
        let words = beams.map(|&(sin, cos)| {
            let to_x = if cos > 0.0 { to_front } else { to_back } / cos.abs().max(1e-9);
            let to_y = if sin > 0.0 { left } else { right } / sin.abs().max(1e-9);
            // One draw a beam: 1 cm up or down, evenly, is enough to tell scans apart.
            let range_m = to_x.min(to_y) + 0.02 * (rng.unit() - 0.5);
            (range_m * units).round().clamp(1.0, 8100.0) as u16
        });
        words.collect()
    }
}

impl ScanSource for Room {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        Some(self.words(t0_ns, (fov_deg, resolution_cdeg), (0, 1), mm))
    }

    fn turn(&mut self, t0_ns: i64, quarter: u8, mm: bool) -> Option<ScanWords> {
        Some(self.words(t0_ns, (180, 25), (usize::from(quarter), 4), mm))
    }
}

/// A scan and its first beam's time.
pub(crate) type Taken = Arc<Mutex<HashMap<Vec<u32>, i64>>>;

/// A laser's room that remembers when each scan was taken.
pub(crate) struct Remembering {
    /// The room.
    pub room: Room,
    /// What was measured in it.
    pub taken: Taken,
}

impl ScanSource for Remembering {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        let words = self.room.scan(t0_ns, fov_deg, resolution_cdeg, mm)?;
        let unit_mm = if mm { 1 } else { 10 };
        let ranges_mm = words.iter().map(|&word| u32::from(word) * unit_mm).collect();
        self.taken.lock().unwrap().insert(ranges_mm, t0_ns);
        Some(words)
    }
}

/// The odometry of the same robot, one tick a millimeter. It also counts time across, so that no two packets
/// are the same.
pub(crate) struct Wheels;

impl OdometrySource for Wheels {
    fn sample(&mut self, t_ns: i64) -> OdometrySample {
        let x_mm = (path_m(t_ns) * 1000.0).round() as i32;
        OdometrySample {
            x_raw: (x_mm & 0x7FFF) as u16,
            left_mm_s: (t_ns / 100_000_000 % 30_000) as i16,
            moving: true,
            path_um: i64::from(x_mm) * 1000,
            ..OdometrySample::default()
        }
    }
}

/// The numbers of a sample say when it was taken: so many seconds as a turn rate, in steps that a 32-bit
/// number resolves to some microseconds, and rounds of so many as an acceleration.
const ROUND_S: i64 = 40;
/// Acceleration of a round, meters per second squared.
const ROUND_M_S2: f64 = 0.01;

/// What an inertial unit says: no two samples are the same, and each says when it was taken.
pub(crate) struct Felt;

impl Felt {
    /// When a sample with these numbers was taken, nanoseconds: turn rate about x, acceleration along x.
    #[must_use]
    pub(crate) fn taken_ns(turn_rad_s: f64, force_m_s2: f64) -> i64 {
        let rounds = (force_m_s2 / ROUND_M_S2).round() as i64;
        rounds * ROUND_S * 1_000_000_000 + (turn_rad_s * 1e9).round() as i64
    }
}

impl InertialFeed for Felt {
    fn sample(&mut self, middle_ns: i64, _period_ns: i64) -> Option<InertialSample> {
        let round_ns = ROUND_S * 1_000_000_000;
        let turn_rad_s = [middle_ns.rem_euclid(round_ns) as f64 * 1e-9, 0.25, -0.5];
        let force_m_s2 = [middle_ns.div_euclid(round_ns) as f64 * ROUND_M_S2, 0.0, 9.75];
        Some(InertialSample { time_ns: middle_ns, turn_rad_s, force_m_s2 })
    }
}
