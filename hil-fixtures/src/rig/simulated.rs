//! A rig driven through a world: two lasers and a base that share one drive.
//!
//! Frame `map`: `base_link` at the start of the drive. Times are nanoseconds since a zero that all devices
//! share; the drive starts at 0 or when [`SimulatedRig::start_drive_at`] says. Every scan is a function of
//! seed, laser and mirror turn, whatever was asked before.

use crate::rig::drive::Drive;
use crate::rig::drive::odometry::{Odometer, OdometryParams};
use crate::rig::fan::Fan;
use crate::rig::inertial::InertialParams;
use crate::rig::scanner::{Scanner, ScannerParams, TURN_NS, Variant};
use crate::rig::source::{OdometrySample, OdometrySource, ScanSource, ScanWords};
use crate::rig::tick;
use crate::rng::Rng;
use crate::world::World;
use crate::world::path::{Path, PathError};
use crate::world::pose::Pose;
use crate::world::scene::Scene;
use biplane_recording::rig::{Base, BaseProtocol, Laser, Mount, Rig, Units};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// How well the simulated devices measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimulationParams {
    /// Both lasers.
    pub scanner: ScannerParams,
    /// The base.
    pub odometry: OdometryParams,
    /// The inertial unit, where the rig has one.
    pub inertial: InertialParams,
}

/// Which laser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaserRole {
    /// The one that localizes.
    Horizontal,
    /// The one that sees the building.
    Vertical,
}

struct Shared {
    scene: Scene,
    drive: Drive,
    odometer: Odometer,
    rig: Rig,
    scanner: ScannerParams,
    seed: u64,
    start_ns: AtomicI64,
}

/// A rig in a world.
#[derive(Clone)]
pub struct SimulatedRig {
    shared: Arc<Shared>,
}

impl SimulatedRig {
    /// Puts the rig at the start of `path`.
    pub fn new(
        world: &World,
        path: &Path,
        rig: &Rig,
        params: &SimulationParams,
        seed: u64,
    ) -> Result<Self, PathError> {
        let (drive, scene) = Drive::through(world, path, seed)?;
        let shared = Shared {
            scene,
            odometer: Odometer::new(&drive, params.odometry, seed),
            drive,
            rig: rig.clone(),
            scanner: params.scanner,
            seed,
            start_ns: AtomicI64::new(0),
        };
        Ok(Self { shared: Arc::new(shared) })
    }

    /// Lets the drive start at `t_ns`; before it the robot stands still. `i64::MAX` holds it back.
    pub fn start_drive_at(&self, t_ns: i64) {
        self.shared.start_ns.store(t_ns, Ordering::Relaxed);
    }

    /// Length of the drive in time, seconds.
    #[must_use]
    pub fn drive_duration_s(&self) -> f64 {
        self.shared.drive.duration_s()
    }

    /// The drive itself, timed from its own start.
    #[must_use]
    pub fn drive(&self) -> &Drive {
        &self.shared.drive
    }

    /// The surfaces around it, in `map`.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.shared.scene
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.shared.rig
    }

    /// Where `base_link` is at `t_ns`.
    #[must_use]
    pub fn map_from_base(&self, t_ns: i64) -> Pose {
        self.shared.drive.pose(self.shared.drive_time_s(t_ns))
    }

    /// The localizing laser.
    #[must_use]
    pub fn horizontal(&self) -> SimulatedLaser {
        SimulatedLaser::new(self, LaserRole::Horizontal, &self.shared.rig.horizontal)
    }

    /// The building-facing laser, if the rig has one.
    #[must_use]
    pub fn vertical(&self) -> Option<SimulatedLaser> {
        let laser = self.shared.rig.vertical.as_ref()?;
        Some(SimulatedLaser::new(self, LaserRole::Vertical, laser))
    }

    /// The base.
    #[must_use]
    pub fn base(&self) -> SimulatedBase {
        SimulatedBase { shared: Arc::clone(&self.shared) }
    }
}

impl Shared {
    fn drive_time_s(&self, t_ns: i64) -> f64 {
        t_ns.saturating_sub(self.start_ns.load(Ordering::Relaxed)) as f64 * 1e-9
    }
}

/// One laser of a simulated rig.
#[derive(Clone)]
pub struct SimulatedLaser {
    shared: Arc<Shared>,
    role: LaserRole,
    base_from_laser: Pose,
}

impl SimulatedLaser {
    fn new(rig: &SimulatedRig, role: LaserRole, laser: &Laser) -> Self {
        Self { shared: Arc::clone(&rig.shared), role, base_from_laser: base_from_laser(&laser.mount) }
    }

    /// Which of the rig's lasers it is.
    #[must_use]
    pub fn role(&self) -> LaserRole {
        self.role
    }

    /// The scan whose first beam is at `t0_ns`. Needs no `&mut`: scans may be taken in any order, on any
    /// thread.
    #[must_use]
    pub fn measure(&self, t0_ns: i64, variant: Variant, mm: bool) -> ScanWords {
        self.with_scanner(t0_ns, |scanner, rng| scanner.scan(t0_ns, variant, mm, rng))
    }

    /// A fan of a laser of today, whose beams are timed by the fan itself.
    #[must_use]
    pub fn measure_fan(&self, fan: &Fan) -> Vec<u16> {
        self.with_scanner(fan.first_beam_ns, |scanner, rng| scanner.fan_mm(fan, rng))
    }

    fn with_scanner<T>(&self, t0_ns: i64, take: impl FnOnce(&Scanner<'_>, &mut Rng) -> T) -> T {
        let scanner = Scanner {
            scene: &self.shared.scene,
            map_from_base: &|t_ns| self.shared.drive.pose(self.shared.drive_time_s(t_ns)),
            base_from_laser: self.base_from_laser,
            params: self.shared.scanner,
        };
        let stream = match self.role {
            LaserRole::Horizontal => 1,
            LaserRole::Vertical => 2,
        };
        take(&scanner, &mut Rng::new(self.shared.seed, stream, t0_ns.div_euclid(TURN_NS)))
    }
}

impl ScanSource for SimulatedLaser {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        Some(self.measure(t0_ns, Variant::new(fov_deg, resolution_cdeg)?, mm))
    }

    fn turn(&mut self, t0_ns: i64, quarter: u8, mm: bool) -> Option<ScanWords> {
        Some(self.with_scanner(t0_ns, |scanner, rng| scanner.turn(t0_ns, quarter, mm, rng)))
    }
}

/// The base of a simulated rig.
#[derive(Clone)]
pub struct SimulatedBase {
    shared: Arc<Shared>,
}

impl OdometrySource for SimulatedBase {
    fn sample(&mut self, t_ns: i64) -> OdometrySample {
        let shared = &self.shared;
        shared.odometer.sample(&shared.drive, shared.drive_time_s(t_ns), metres_per_tick(&shared.rig.base))
    }
}

/// Length of a P2OS base's tick: what the rig says, or that of the subclass which the mock tells.
#[must_use]
pub fn metres_per_tick(base: &Base) -> f64 {
    match base.protocol {
        BaseProtocol::P2os { metres_per_tick: Some(metres_per_tick) } => metres_per_tick,
        _ => tick::metres_per_tick(tick::DEFAULT_SUBCLASS),
    }
}

/// Where a laser sits on the base.
#[must_use]
pub fn base_from_laser(mount: &Mount) -> Pose {
    Pose::from_angles([mount.x, mount.y, mount.z], [mount.roll, mount.pitch, mount.yaw].map(f64::to_radians))
}

/// The variant that a rig's laser is set to; `None` for one that no LMS has.
#[must_use]
pub fn variant_of(laser: &Laser) -> Option<Variant> {
    Variant::new(laser.fov_deg, (laser.resolution_deg * 100.0).round() as u16)
}

/// Whether a rig's laser counts in millimeters.
#[must_use]
pub fn counts_mm(laser: &Laser) -> bool {
    laser.units == Units::Mm
}

/// The measuring mode in which a rig's laser reaches as far as it is asked to: 13 bits of range, or 14 (04)
/// or 15 (06).
#[must_use]
pub fn measuring_mode(laser: &Laser) -> u8 {
    let counts = f64::from(laser.range_max_m.unwrap_or(0)) / laser.units.meters();
    match counts {
        counts if counts < 8192.0 => 0,
        counts if counts < 16_384.0 => 4,
        _ => 6,
    }
}

#[cfg(test)]
mod tests {
    use super::{SimulatedRig, SimulationParams};
    use crate::rig::source::{OdometrySource, ScanSource};
    use crate::world::World;
    use biplane_recording::Rig;

    fn corridor() -> SimulatedRig {
        let world = World::named("corridor").expect("built in");
        let path = world.path(None).expect("has a path").clone();
        SimulatedRig::new(&world, &path, &Rig::default(), &SimulationParams::default(), 3).expect("drives")
    }

    #[test]
    fn the_robot_waits_until_the_drive_is_started() {
        let rig = corridor();
        rig.start_drive_at(i64::MAX);
        assert!(!rig.base().sample(50_000_000_000).moving);
        rig.start_drive_at(40_000_000_000);
        assert!(rig.base().sample(50_000_000_000).moving);
        assert!(rig.map_from_base(45_000_000_000).translation_m[0] > 0.5);
        assert!(rig.map_from_base(40_000_000_000).translation_m[0] < 1e-9);
    }

    #[test]
    fn a_scan_does_not_depend_on_what_was_asked_before() {
        let mut first = corridor().horizontal();
        let mut second = corridor().horizontal();
        let _ = first.scan(1_000_000_000, 180, 100, false);
        let later = first.scan(9_000_000_000, 180, 100, false).expect("a variant it has");
        assert_eq!(second.scan(9_000_000_000, 180, 100, false), Some(later));
        assert_eq!(second.scan(0, 180, 25, false), None);
    }

    #[test]
    fn the_lasers_see_the_corridor_around_them() {
        let rig = corridor();
        let vertical =
            rig.vertical().expect("the default rig has one").scan(0, 180, 100, true).expect("a scan");
        // Straight up from 0.45 m: the lamp at 2.61 m; to the sides the walls at 1.08 m and 1.12 m.
        let near = |word: u16, meters: f64| (f64::from(word) * 0.001 - meters).abs() < 0.08;
        assert!(
            near(vertical[90], 2.16) && near(vertical[0], 1.08) && near(vertical[180], 1.12),
            "{vertical:?}"
        );
        let horizontal = rig.horizontal().scan(0, 180, 100, false).expect("a scan");
        assert!((f64::from(horizontal[90]) * 0.01 - 12.3).abs() < 0.3, "{}", horizontal[90]);
    }

    #[test]
    fn points_of_a_driving_laser_rebuild_the_ceiling_to_within_the_noise() {
        let rig = corridor();
        let mount = rig.rig().vertical.as_ref().expect("the default rig has one").mount;
        let mut heights = Vec::new();
        for k in 0..40 {
            let t0_ns = 25_000_000_000 + k * 106_560_000;
            let words = rig.vertical().expect("has one").scan(t0_ns, 180, 100, true).expect("a scan");
            for beam in 70..110_u16 {
                let range_m = f64::from(words[usize::from(beam)]) * 0.001;
                let angle = (f64::from(beam) - 90.0).to_radians();
                let [x, y, z] = mount.base_from_laser([range_m * angle.cos(), range_m * angle.sin(), 0.0]);
                let taken_ns = t0_ns + i64::from(beam) * 37_000;
                let pose = rig.map_from_base(taken_ns);
                let (sin, cos) = pose.yaw_rad().sin_cos();
                let at =
                    [pose.translation_m[0] + cos * x - sin * y, pose.translation_m[1] + sin * x + cos * y];
                // Free ceiling between two lamps, right of the cable tray.
                if (5.3..6.2).contains(&at[0]) && (-0.9..0.6).contains(&at[1]) {
                    heights.push(z - 2.7);
                }
            }
        }
        let n = heights.len() as f64;
        let mean = heights.iter().sum::<f64>() / n;
        let sigma = (heights.iter().map(|h| (h - mean) * (h - mean)).sum::<f64>() / n).sqrt();
        assert!(n > 500.0 && mean.abs() < 0.002 && (0.013..0.0165).contains(&sigma), "{n} {mean} {sigma}");
    }
}
