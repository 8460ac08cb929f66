//! What is simulated, what came of it, and why it could not be.

use crate::devices::cola::ColaParams;
use crate::devices::scip::ScipParams;
use crate::faults::{Faults, Misplaced};
use crate::line::ReadParams;
use crate::rig::simulated::SimulationParams;
use crate::simulate::truth_folder::TruthError;
use crate::world::WorldError;
use crate::world::ifc::StoreyChoice;
use crate::world::path::PathError;
use biplane_recording::{RigError, WriteError};
use biplane_wire::WireError;
use std::path::PathBuf;

/// Time of every capture's start, UTC nanoseconds.
pub(super) const START_UTC_NS: i64 = 1_000_000_000_000_000_000;

/// The lasers of a rig, as far as it does not say.
#[derive(Clone, Debug, Default)]
pub struct LaserOptions {
    /// Millionths by which the mirrors of the horizontal and the vertical laser turn too slowly. Scans, index
    /// bytes and truth follow; the beams inside a scan of an LMS 2xx keep the nominal turn (at 100 millionths
    /// 4 us in a scan of four turns). Lasers of today turn slower by so much than their kind does anyway.
    pub mirror_ppm: [f64; 2],
    /// SICK lasers that the rig has on the network, before they are set as it asks.
    pub network_laser: ColaParams,
    /// Hokuyo lasers that the rig has; their line is the rig's.
    pub hokuyo: ScipParams,
}

/// What to simulate, and where to.
#[derive(Clone, Debug)]
pub struct SimulateOptions {
    /// A built-in world's name, or an OBJ, PLY or IFC file.
    pub world: String,
    /// Which storey of an IFC file, and how its doors stand.
    pub storey: StoreyChoice,
    /// A built-in path's name, or a path file; the world's usual path without it.
    pub path: Option<String>,
    /// Cruising speed instead of the path's, m/s.
    pub speed_m_s: Option<f64>,
    /// The rig; the template without it.
    pub rig: Option<PathBuf>,
    /// Of all noise and all phases.
    pub seed: u64,
    /// The capture.
    pub output: PathBuf,
    /// Directory for the truth.
    pub truth: Option<PathBuf>,
    /// Replace an existing capture and an existing truth.
    pub overwrite: bool,
    /// Begin with what the devices answer while they are set up.
    pub start_up: bool,
    /// Standing still before and after the drive, seconds.
    pub stand_s: f64,
    /// How well the devices measure.
    pub params: SimulationParams,
    /// How the bytes reach the computer.
    pub reads: ReadParams,
    /// Which lasers the rig has.
    pub lasers: LaserOptions,
    /// What goes wrong: on the lines, in front of the lasers, with the clock that stamps the capture.
    pub faults: Faults,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            world: "corridor".to_owned(),
            storey: StoreyChoice::default(),
            path: None,
            speed_m_s: None,
            rig: None,
            seed: 1,
            output: PathBuf::from("capture.mcap"),
            truth: None,
            overwrite: false,
            start_up: false,
            stand_s: 0.5,
            params: SimulationParams::default(),
            reads: ReadParams::default(),
            lasers: LaserOptions::default(),
            faults: Faults::default(),
        }
    }
}

/// What was simulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimulateReport {
    /// Telegrams of the localizing laser.
    pub scans_horizontal: usize,
    /// Telegrams of the building-facing laser.
    pub scans_vertical: usize,
    /// Values of the latter that are ranges.
    pub echoes_vertical: usize,
    /// Packets of the base.
    pub odometry: usize,
    /// Samples of an inertial unit, as messages or as bytes.
    pub inertial: usize,
    /// Length of the capture, seconds.
    pub duration_s: f64,
    /// Length of the way, meters.
    pub driven_m: f64,
    /// Bytes on all lines.
    pub serial_bytes: u64,
    /// Of a world with a plan: rooms that the drive enters, and all of them.
    pub rooms: Option<[usize; 2]>,
}

/// Why nothing, or not everything, was simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The world.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The path.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The rig file.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A rig that the simulator does not know.
    #[error("{what} = {found} of the rig cannot be simulated: {expected}")]
    Unsupported {
        /// The rig's key.
        what: &'static str,
        /// Its value.
        found: String,
        /// What can.
        expected: &'static str,
    },
    /// A number that makes no capture.
    #[error("{what} = {found}: expected {expected}")]
    BadNumber {
        /// The option.
        what: &'static str,
        /// Its value.
        found: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A fault that a capture without a client cannot have.
    #[error(transparent)]
    Fault(#[from] Misplaced),
    /// A telegram.
    #[error("a telegram could not be put together: {0:?}")]
    Telegram(WireError),
    /// The capture.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The truth.
    #[error(transparent)]
    Truth(#[from] TruthError),
}

impl From<WireError> for SimulateError {
    fn from(error: WireError) -> Self {
        Self::Telegram(error)
    }
}
