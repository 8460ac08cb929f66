//! A mock rig on pseudo-terminals: two lasers and a base that answer their protocols and then stream a world or a capture.
//!
//! Each device runs on a thread of its own, on a virtual clock that is the wall clock times `speed`. A link in the chosen folder
//! appears when its device is ready and is removed when the mock ends.

pub mod clock;
pub mod port;
pub mod run;
pub mod world;

use crate::base_device::feed::CycleFeed;
use crate::base_device::{BaseDevice, BaseParams};
use crate::device::Device;
use crate::drive::Drive;
use crate::faults::{Channel, Preset};
use crate::lms_device::feed::{Mirror, MirrorFeed};
use crate::lms_device::{LmsDevice, LmsParams};
use crate::pose::Pose;
use crate::pty::{Pty, PtyError};
use crate::rng::Rng;
use crate::world::World;
use crate::world::path::{Path as DrivePath, PathError};
use crate::world::scene::Scene;
use clock::VirtualClock;
use port::{Port, PortReport};
use run::{Run, RunRules};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use world::{RigPlan, Stage, StageOdometry, StageScans};

const NS_PER_S: f64 = 1e9;

/// A packet of odometry each tenth of a second.
const SIP_CYCLE_NS: i64 = 100_000_000;

/// The vertical mirror passes its zero this long after the horizontal one: nothing couples the two.
const VERTICAL_PHASE_NS: i64 = 5_170_000;

/// Requests may be held up by the scheduler of a busy machine; a real device allows 6 ms between bytes.
const REQUEST_GAP_NS: i64 = 25_000_000;

/// What is measured.
#[derive(Clone, Debug)]
pub enum Source {
    /// A world, driven along a path.
    World {
        /// The world.
        world: Box<World>,
        /// The path.
        path: DrivePath,
        /// The rig that drives.
        plan: RigPlan,
    },
}

/// What `serve` is to do.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// What the devices measure.
    pub source: Source,
    /// Folder of the links; made when it is missing.
    pub links: PathBuf,
    /// How many times faster than real time; 1 is a real rig.
    pub speed: f64,
    /// At the end of the drive or capture: fall silent and end.
    pub once: bool,
    /// Faults on the lines, the first nearest to the device.
    pub faults: Vec<Preset>,
    /// Seed of faults and noise.
    pub seed: u64,
    /// The drive begins this many seconds after the links are there, instead of when all devices stream.
    pub start_after_s: Option<f64>,
    /// How the lasers are at the start.
    pub laser: LmsParams,
    /// How the base is at the start.
    pub base: BaseParams,
    /// Whether clients at a wrong rate are understood (for clients that set their rate by a custom divisor).
    pub any_baud: bool,
}

impl ServeOptions {
    /// A rig in perfect order at real speed.
    #[must_use]
    pub fn new(source: Source, links: PathBuf) -> Self {
        Self {
            source,
            links,
            speed: 1.0,
            once: false,
            faults: Vec::new(),
            seed: 1,
            start_after_s: None,
            laser: LmsParams::default(),
            base: BaseParams::default(),
            any_baud: false,
        }
    }
}

/// Why the mock could not serve.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The folder of the links could not be made.
    #[error("{}: cannot make this folder: {source}", path.display())]
    Links {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A pseudo-terminal or its link failed.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The path cannot be driven.
    #[error(transparent)]
    Path(#[from] PathError),
    /// A speed that is not above zero.
    #[error("speed {speed}: must be a number above 0")]
    Speed {
        /// The speed given.
        speed: f64,
    },
    /// A device's thread could not be started, or failed.
    #[error("the thread of {name} failed")]
    Thread {
        /// Name of its link.
        name: &'static str,
    },
}

/// What the mock has done.
#[derive(Clone, Debug, Default)]
pub struct ServeReport {
    /// One entry a device.
    pub ports: Vec<PortReport>,
}

/// Serves until `stop`, or until the end with `once`. `ready` is called when all links are there.
pub fn serve(
    options: &ServeOptions,
    stop: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<ServeReport, ServeError> {
    if !(options.speed.is_finite() && options.speed > 0.0) {
        return Err(ServeError::Speed { speed: options.speed });
    }
    std::fs::create_dir_all(&options.links)
        .map_err(|source| ServeError::Links { path: options.links.clone(), source })?;
    let Source::World { world, path, plan } = &options.source;
    let drive = Drive::new(path, options.seed)?;
    let end_ns = (drive.duration_s() * NS_PER_S) as i64;
    let scene = Scene::new(world.mesh.moved(&drive.map_from_world()));
    let stage = Stage { scene: Arc::new(scene), drive: Arc::new(drive), seed: options.seed };
    let run = Run::new(RunRules {
        devices: 2 + usize::from(plan.vertical.is_some()),
        pause_ns: NS_PER_S as i64,
        patience_ns: None,
        start_at_ns: options.start_after_s.map(|s| (s * NS_PER_S) as i64),
    });
    let mut devices: Vec<(&'static str, Box<dyn Device>)> = Vec::new();
    let laser = |base_from_laser: Pose, stream, phase_ns| {
        let source = StageScans { stage: stage.clone(), base_from_laser, stream };
        let feed = MirrorFeed::new(Box::new(source), Box::new(run.clone()));
        Box::new(LmsDevice::new(laser_params(options, phase_ns), Box::new(feed)))
    };
    devices.push(("lms-horizontal", laser(plan.horizontal, 1, 0)));
    if let Some(vertical) = plan.vertical {
        devices.push(("lms-vertical", laser(vertical, 2, VERTICAL_PHASE_NS)));
    }
    let odometry = StageOdometry::new(stage.clone(), plan.metres_per_tick);
    let feed = CycleFeed::new(Box::new(odometry), Box::new(run.clone()), SIP_CYCLE_NS);
    devices.push(("base", Box::new(BaseDevice::new(options.base.clone(), Box::new(feed)))));
    let ports = open_ports(options, devices)?;
    run_ports(ports, options, &run, end_ns, stop, ready)
}

fn laser_params(options: &ServeOptions, phase_ns: i64) -> LmsParams {
    let mut params = options.laser.clone();
    params.mirror = Mirror { phase_ns: params.mirror.phase_ns + phase_ns, ..params.mirror };
    params.request_gap_ns =
        params.request_gap_ns.max((REQUEST_GAP_NS as f64 * options.speed.max(1.0)) as i64);
    params
}

fn open_ports(
    options: &ServeOptions,
    devices: Vec<(&'static str, Box<dyn Device>)>,
) -> Result<Vec<Port>, ServeError> {
    let mut ports = Vec::new();
    for (place, (name, device)) in devices.into_iter().enumerate() {
        let mut pty = Pty::open(device.baud())?;
        pty.publish(&link(&options.links, name))?;
        let stream = place as u64;
        ports.push(Port {
            name,
            place,
            device,
            pty,
            to_host: Channel::new(&options.faults, options.seed, 2 * stream),
            from_host: Channel::new(&options.faults, options.seed, 2 * stream + 1),
            noise: Rng::new(options.seed, 0x0015_E000 + stream, 0),
            any_baud: options.any_baud,
        });
    }
    Ok(ports)
}

fn link(folder: &Path, name: &str) -> PathBuf {
    folder.join(name)
}

fn run_ports(
    ports: Vec<Port>,
    options: &ServeOptions,
    run: &Run,
    end_ns: i64,
    stop: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<ServeReport, ServeError> {
    let clock = VirtualClock::start(options.speed);
    let stop_all = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let threads: Vec<_> = ports
            .into_iter()
            .map(|port| (port.name, scope.spawn(|| port.run(clock, run, &stop_all))))
            .collect();
        ready();
        while !stop.load(Ordering::Relaxed) && !threads.iter().any(|(_, thread)| thread.is_finished()) {
            let over =
                run.begun().is_some_and(|begun| clock.now_ns() > begun.start_ns + end_ns + NS_PER_S as i64);
            if options.once && over {
                break;
            }
            biplane_clock::sleep_ns(20_000_000);
        }
        stop_all.store(true, Ordering::Relaxed);
        let mut report = ServeReport::default();
        for (name, thread) in threads {
            report.ports.push(thread.join().map_err(|_| ServeError::Thread { name })?);
        }
        Ok(report)
    })
}
