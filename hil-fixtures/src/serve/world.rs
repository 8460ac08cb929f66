//! A world as the devices of a rig measure it: the scene, the drive through it, and where the lasers sit.
//!
//! Frame `map`: `base_link` at the start of the drive. Times are nanoseconds since that start.

use crate::drive::Drive;
use crate::odometry::{Odometer, OdometryParams};
use crate::pose::Pose;
use crate::rng::Rng;
use crate::scanner::{Scanner, ScannerParams, Variant};
use crate::source::{OdometrySample, OdometrySource, ScanSource, ScanWords};
use crate::world::scene::Scene;
use std::sync::Arc;

/// A scene and the drive through it.
#[derive(Clone)]
pub struct Stage {
    /// Surfaces, in `map`.
    pub scene: Arc<Scene>,
    /// Where `base_link` is at any time.
    pub drive: Arc<Drive>,
    /// Seed of all noise.
    pub seed: u64,
}

fn seconds(t_ns: i64) -> f64 {
    t_ns as f64 * 1e-9
}

/// Where the devices of a rig sit.
#[derive(Clone, Debug)]
pub struct RigPlan {
    /// `base_from_laser` of the laser that localises.
    pub horizontal: Pose,
    /// `base_from_laser` of the laser that sees the building, if there is one.
    pub vertical: Option<Pose>,
    /// Length of one unit of the base's odometry.
    pub metres_per_tick: f64,
}

impl Default for RigPlan {
    /// The mounts of the contract: the vertical fan's middle beam points up.
    fn default() -> Self {
        let up = [0.0, (-90f64).to_radians(), 0.0];
        Self {
            horizontal: Pose::from_angles([0.2, 0.0, 0.3], [0.0; 3]),
            vertical: Some(Pose::from_angles([0.05, 0.0, 0.45], up)),
            metres_per_tick: 0.001,
        }
    }
}

/// One laser of the rig.
pub struct StageScans {
    /// The world.
    pub stage: Stage,
    /// Where the laser sits.
    pub base_from_laser: Pose,
    /// Tells the noise of the rig's lasers apart.
    pub stream: u64,
}

impl ScanSource for StageScans {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        let variant = Variant::new(fov_deg, resolution_cdeg)?;
        let drive = &self.stage.drive;
        let scanner = Scanner {
            scene: &self.stage.scene,
            map_from_base: &|t_ns| drive.pose(seconds(t_ns)),
            base_from_laser: self.base_from_laser,
            params: ScannerParams::default(),
        };
        let mut rng = Rng::new(self.stage.seed, self.stream, t0_ns);
        Some(scanner.scan(t0_ns, variant, mm, &mut rng))
    }
}

/// The base of the rig.
pub struct StageOdometry {
    stage: Stage,
    odometer: Odometer,
    metres_per_tick: f64,
}

impl StageOdometry {
    /// Odometry that drifts.
    #[must_use]
    pub fn new(stage: Stage, metres_per_tick: f64) -> Self {
        let odometer = Odometer::new(&stage.drive, OdometryParams::default(), stage.seed);
        Self { stage, odometer, metres_per_tick }
    }
}

impl OdometrySource for StageOdometry {
    fn sample(&mut self, t_ns: i64) -> OdometrySample {
        self.odometer.sample(&self.stage.drive, seconds(t_ns), self.metres_per_tick)
    }
}
