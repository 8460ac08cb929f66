//! What is served, under which names, and why it could not be.

use super::lock::LockError;
use crate::capture::source::Capture;
use crate::devices::base::BaseParams;
use crate::devices::cola::ColaParams;
use crate::devices::lms::LmsParams;
use crate::devices::pty::PtyError;
use crate::devices::scip::ScipParams;
use crate::faults::{Faults, Misplaced};
use crate::rig::simulated::SimulationParams;
use crate::simulate::truth_folder::TruthError;
use crate::world::World;
use crate::world::path::{Path as DrivePath, PathError};
use biplane_recording::Rig;
use std::fmt;
use std::path::PathBuf;

/// The devices of a rig by the names of their links.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LinkName {
    /// `lms-horizontal`
    Horizontal,
    /// `lms-vertical`
    Vertical,
    /// `base`
    Base,
    /// `imu`
    Imu,
}

impl LinkName {
    /// File name of the link.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Horizontal => "lms-horizontal",
            Self::Vertical => "lms-vertical",
            Self::Base => "base",
            Self::Imu => "imu",
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
    /// The lasers of a rig that are on the network.
    pub network_laser: ColaParams,
    /// The Hokuyo lasers of a rig; one whose line is not the rig's is put on that.
    pub hokuyo: ScipParams,
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
            network_laser: ColaParams::default(),
            hokuyo: ScipParams::default(),
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
    /// A device could not listen on the network.
    #[error("{name}: cannot listen on a port of this machine: {source}")]
    Network {
        /// Name of its link.
        name: LinkName,
        /// What the system said.
        source: std::io::Error,
    },
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
    /// The system gave no thread for a device.
    #[error("{name}: the system gives no thread for this device: {source}")]
    Refused {
        /// Name of its link.
        name: LinkName,
        /// What the system said.
        source: std::io::Error,
    },
    /// A device's thread failed.
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
