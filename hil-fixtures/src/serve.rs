//! A mock rig on pseudo-terminals: two lasers and a base that answer their protocols and then stream a world or a capture.
//!
//! Each device runs on a thread of its own, on a virtual clock that is the wall clock times `speed`. A link in the chosen folder
//! appears when its device is ready and is removed when the mock ends.

pub mod ahead;
pub mod clock;
pub mod devices;
pub mod lock;
pub mod port;
pub mod run;
pub mod truth;

use crate::base_device::BaseParams;
use crate::capture_source::Capture;
use crate::faults::{Faults, Misplaced, Place};
use crate::lms_device::LmsParams;
use crate::pty::{Pty, PtyError};
use crate::rng::Rng;
use crate::simulated_rig::SimulationParams;
use crate::truth_folder::{TruthError, prepare};
use crate::world::World;
use crate::world::path::{Path as DrivePath, PathError};
use biplane_recording::Rig;
use clock::VirtualClock;
use devices::Devices;
use lock::{FolderLock, LockError};
use port::{Port, PortReport};
use run::Begun;
use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use truth::TruthWriter;

/// With `once`, the mock ends this long after the drive or capture: a client has noticed the silence by then.
const SILENCE_NS: i64 = 1_000_000_000;

/// How often the main thread looks whether to stop; wall time.
const LOOK_NS: i64 = 20_000_000;

/// The devices of a rig by the names of their links.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LinkName {
    /// `lms-horizontal`
    Horizontal,
    /// `lms-vertical`
    Vertical,
    /// `base`
    Base,
}

impl LinkName {
    /// File name of the link.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Horizontal => "lms-horizontal",
            Self::Vertical => "lms-vertical",
            Self::Base => "base",
        }
    }
}

impl fmt::Display for LinkName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What is measured.
#[derive(Clone, Debug)]
pub enum Source {
    /// A world, driven along a path.
    World {
        /// The world.
        world: Box<World>,
        /// The path.
        path: Box<DrivePath>,
        /// The rig that drives: its mounts and the base's tick.
        rig: Box<Rig>,
        /// How well its devices measure.
        params: SimulationParams,
    },
    /// A capture, played from its start.
    Capture {
        /// The capture.
        capture: Box<Capture>,
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
    /// What goes wrong.
    pub faults: Faults,
    /// Seed of the noise.
    pub seed: u64,
    /// The drive begins this many seconds after the links are there, instead of when all devices stream.
    pub start_after_s: Option<f64>,
    /// How the lasers are at the start.
    pub laser: LmsParams,
    /// Millionths by which the mirrors of the horizontal and the vertical laser turn too slowly.
    pub mirror_ppm: [f64; 2],
    /// How the base is at the start.
    pub base: BaseParams,
    /// Folder for the truth of a world; made when it is missing.
    pub truth: Option<PathBuf>,
    /// Replace an earlier truth in that folder. A run replaces that of the run before in any case.
    pub overwrite: bool,
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
            faults: Faults::default(),
            seed: 1,
            start_after_s: None,
            laser: LmsParams::default(),
            mirror_ppm: [0.0; 2],
            base: BaseParams::default(),
            truth: None,
            overwrite: false,
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
    /// The folder of the links is another mock's.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// A pseudo-terminal or its link failed.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The path cannot be driven.
    #[error(transparent)]
    Path(#[from] PathError),
    /// A fault that a mock on ports cannot have.
    #[error(transparent)]
    Fault(#[from] Misplaced),
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
        name: LinkName,
    },
    /// The truth could not be written.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// A truth was asked for, but a capture has none.
    #[error("a capture has no truth: leave the folder for it out, or serve a world")]
    NoTruth,
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
    options.faults.check(Place::Serve)?;
    std::fs::create_dir_all(&options.links)
        .map_err(|source| ServeError::Links { path: options.links.clone(), source })?;
    if options.truth.is_some() && matches!(options.source, Source::Capture { .. }) {
        return Err(ServeError::NoTruth);
    }
    // Held to the end: links that stand here without it are those of a mock that is dead.
    let _lock = FolderLock::take(&options.links)?;
    if let Some(folder) = &options.truth {
        prepare(folder, options.overwrite)?;
    }
    let mut devices = Devices::new(options)?;
    let ports = open_ports(options, &mut devices)?;
    run_ports(ports, options, &devices, stop, ready)
}

fn open_ports(options: &ServeOptions, devices: &mut Devices) -> Result<Vec<Port>, ServeError> {
    let mut ports = Vec::new();
    for (place, (name, device)) in devices.list.drain(..).enumerate() {
        let mut pty = Pty::open(device.baud())?;
        pty.publish(&options.links.join(name.name()))?;
        let stream = place as u64;
        ports.push(Port {
            name,
            place,
            device,
            pty,
            to_host: options.faults.channel(2 * stream),
            from_host: options.faults.channel(2 * stream + 1),
            noise: Rng::new(options.seed, 0x0015_E000 + stream, 0),
            any_baud: options.any_baud,
        });
    }
    Ok(ports)
}

fn run_ports(
    ports: Vec<Port>,
    options: &ServeOptions,
    devices: &Devices,
    stop: &AtomicBool,
    ready: impl FnOnce(),
) -> Result<ServeReport, ServeError> {
    let clock = VirtualClock::start(options.speed);
    let stop_all = AtomicBool::new(false);
    let run = &devices.run;
    std::thread::scope(|scope| {
        let threads: Vec<_> = ports
            .into_iter()
            .map(|port| (port.name, scope.spawn(|| port.run(clock, run, &stop_all))))
            .collect();
        ready();
        let mut truth = TruthKeeper { options, devices, clock, last: None, failed: None };
        while !stop.load(Ordering::Relaxed) && !threads.iter().any(|(_, thread)| thread.is_finished()) {
            truth.look();
            let over = truth
                .last
                .is_some_and(|begun| clock.now_ns() > begun.start_ns + devices.length_ns + SILENCE_NS);
            if options.once && over || truth.failed.is_some() {
                break;
            }
            biplane_clock::sleep_ns(LOOK_NS);
        }
        stop_all.store(true, Ordering::Relaxed);
        let mut report = ServeReport::default();
        for (name, thread) in threads {
            report.ports.push(thread.join().map_err(|_| ServeError::Thread { name })?);
        }
        truth.finish()?;
        Ok(report)
    })
}

/// Writes the truth: the drive when it begins, the scans at the end.
struct TruthKeeper<'a> {
    options: &'a ServeOptions,
    devices: &'a Devices,
    clock: VirtualClock,
    /// The last run seen.
    last: Option<Begun>,
    failed: Option<TruthError>,
}

impl TruthKeeper<'_> {
    fn writer(&self) -> Option<(TruthWriter<'_>, &devices::WorldTruth)> {
        let (folder, world, begun) =
            (self.options.truth.as_deref()?, self.devices.world.as_ref()?, self.last?);
        Some((TruthWriter { folder, rig: &world.rig, clock: self.clock, begun }, world))
    }

    fn look(&mut self) {
        let begun = self.devices.run.begun();
        if begun.is_some() && begun != self.last {
            self.last = begun;
            let written = self.writer().map_or(Ok(()), |(writer, _)| writer.write_drive());
            self.failed = written.err();
        }
    }

    fn finish(mut self) -> Result<(), TruthError> {
        if let Some(failed) = self.failed.take() {
            return Err(failed);
        }
        let Some((writer, world)) = self.writer() else { return Ok(()) };
        writer.write_scans("scans_horizontal.txt", "poses.tum", &world.horizontal)?;
        if world.rig.vertical().is_some() {
            writer.write_scans("scans_vertical.txt", "poses_vertical.tum", &world.vertical)?;
        }
        Ok(())
    }
}
