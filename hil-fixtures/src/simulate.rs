//! Drives a rig through a known world: the serial bytes that its devices would have sent, and the truth.
//!
//! The lasers turn freely, each with its own phase, and send every n-th scan as their line allows; the base sends its packet every
//! 100 ms. The capture begins when all of them stream (or with the replies of their start-up), the robot stands still for a
//! moment, drives, and stands again. Only whole telegrams are in the capture.

use crate::capture_file::{About, write_capture};
use crate::faults::{Faults, Misplaced, Place};
use crate::line::ReadParams;
use crate::same_file::{SameFile, refuse_same_file};
use crate::simulated_rig::{LaserRole, SimulatedRig, SimulationParams, variant_of};
use crate::truth::Truth;
use crate::truth_folder::{TruthError, prepare};
use crate::world::path::{Path as DrivePath, PathError};
use crate::world::{World, WorldError};
use biplane_recording::{Rig, RigError, WriteError};
use biplane_wire::WireError;
use devices::{record_base, record_laser};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

mod devices;

/// What to simulate, and where to.
#[derive(Clone, Debug)]
pub struct SimulateOptions {
    /// A built-in world's name, or an OBJ or PLY file.
    pub world: String,
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
    /// Time of the capture's start, UTC nanoseconds.
    pub start_utc_ns: i64,
    /// How well the devices measure.
    pub params: SimulationParams,
    /// How the bytes reach the computer.
    pub reads: ReadParams,
    /// Millionths by which the mirrors of the horizontal and the vertical laser turn too slowly. Scans, index bytes and truth follow; the
    /// beams inside a scan keep the nominal turn (at 100 millionths 4 us in a scan of four turns).
    pub mirror_ppm: [f64; 2],
    /// What goes wrong: on the lines, in front of the lasers, with the clock that stamps the capture.
    pub faults: Faults,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            world: "corridor".to_owned(),
            path: None,
            speed_m_s: None,
            rig: None,
            seed: 1,
            output: PathBuf::from("capture.mcap"),
            truth: None,
            overwrite: false,
            start_up: false,
            stand_s: 0.5,
            start_utc_ns: 1_000_000_000_000_000_000,
            params: SimulationParams::default(),
            reads: ReadParams::default(),
            mirror_ppm: [0.0; 2],
            faults: Faults::default(),
        }
    }
}

/// What was simulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimulateReport {
    /// Telegrams of the localising laser.
    pub scans_horizontal: usize,
    /// Telegrams of the building-facing laser.
    pub scans_vertical: usize,
    /// Values of the latter that are ranges.
    pub echoes_vertical: usize,
    /// Packets of the base.
    pub odometry: usize,
    /// Length of the capture, seconds.
    pub duration_s: f64,
    /// Length of the way, metres.
    pub driven_m: f64,
    /// Bytes on all lines.
    pub serial_bytes: u64,
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
    /// The output is the world, path or rig.
    #[error(transparent)]
    SameFile(#[from] SameFile),
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

/// Time that a start-up takes.
const START_UP_NS: i64 = 600_000_000;

/// Simulates and writes the files.
pub fn run(options: &SimulateOptions) -> Result<SimulateReport, SimulateError> {
    refuse_inputs(options)?;
    options.faults.check(Place::Simulate)?;
    let world = World::open(&options.world)?;
    let path = drive_path(&world, options)?;
    let rig = match &options.rig {
        Some(file) => Rig::load(file)?,
        None => Rig::default(),
    };
    check(&rig, options)?;
    let simulated = SimulatedRig::new(&world, &path, &rig, &options.params, options.seed)?;
    if let Some(directory) = &options.truth {
        prepare(directory, options.overwrite)?;
    }
    let times = Times::plan(&simulated, options);
    simulated.start_drive_at(times.drive_ns);
    let mut report = SimulateReport {
        duration_s: times.end_ns as f64 * 1e-9,
        driven_m: simulated.drive().length_m(),
        ..SimulateReport::default()
    };

    let horizontal = record_laser(&simulated.horizontal(), &rig.horizontal, &times, options)?;
    report.scans_horizontal = horizontal.first_beams_ns.len();
    let vertical = match (simulated.vertical(), &rig.vertical) {
        (Some(laser), Some(settings)) => Some(record_laser(&laser, settings, &times, options)?),
        _ => None,
    };
    let base = record_base(&simulated, &times, options)?;
    report.odometry = base.reports;
    let mut lines = vec![horizontal.line];
    if let Some(vertical) = &vertical {
        report.scans_vertical = vertical.first_beams_ns.len();
        report.echoes_vertical = vertical.echoes;
        lines.push(vertical.line.clone());
    }
    lines.extend(base.lines);
    report.serial_bytes = lines.iter().flat_map(|line| &line.reads).map(|read| read.bytes.len() as u64).sum();

    let about = about(options, &world, &path);
    let mut clock = options.faults.host_clock(options.start_utc_ns);
    write_capture(&options.output, options.overwrite, &rig, &about, &lines, &mut clock)?;
    if let Some(directory) = &options.truth {
        let truth = Truth::new(&simulated, directory, options.start_utc_ns);
        truth.scans(LaserRole::Horizontal, &horizontal.first_beams_ns)?;
        if let Some(vertical) = &vertical {
            truth.scans(LaserRole::Vertical, &vertical.first_beams_ns)?;
        }
        truth.trajectory(0, times.end_ns)?;
        truth.surfaces()?;
    }
    Ok(report)
}

fn refuse_inputs(options: &SimulateOptions) -> Result<(), SameFile> {
    let files =
        [Some(options.world.as_ref()), options.path.as_deref().map(Path::new), options.rig.as_deref()];
    files.into_iter().flatten().try_for_each(|input| refuse_same_file(input, &options.output))
}

fn drive_path(world: &World, options: &SimulateOptions) -> Result<DrivePath, SimulateError> {
    let mut path = world.path_or_file(options.path.as_deref())?;
    if let Some(speed_m_s) = options.speed_m_s {
        path.speed_m_s = speed_m_s;
    }
    Ok(path)
}

fn check(rig: &Rig, options: &SimulateOptions) -> Result<(), SimulateError> {
    for laser in [Some(&rig.horizontal), rig.vertical.as_ref()].into_iter().flatten() {
        if variant_of(laser).is_none() {
            let found = format!("{} ({} degrees)", laser.resolution_deg, laser.fov_deg);
            let expected = "100 degrees in steps of 0.25, 0.5 or 1 and 180 degrees in steps of 0.5 or 1 can";
            return Err(SimulateError::Unsupported { what: "resolution_deg", found, expected });
        }
    }
    if !(0.0..=3600.0).contains(&options.stand_s) {
        let expected = "0 to 3600 seconds";
        return Err(SimulateError::BadNumber { what: "stand_s", found: options.stand_s, expected });
    }
    Ok(())
}

/// When what happens, in device time: 0 is the start of the capture.
struct Times {
    stream_ns: i64,
    drive_ns: i64,
    end_ns: i64,
}

impl Times {
    fn plan(rig: &SimulatedRig, options: &SimulateOptions) -> Self {
        let stream_ns = if options.start_up { START_UP_NS } else { 0 };
        let stand_ns = (options.stand_s * 1e9) as i64;
        let drive_ns = stream_ns + stand_ns;
        let end_ns = drive_ns + (rig.drive_duration_s() * 1e9) as i64 + stand_ns;
        Self { stream_ns, drive_ns, end_ns }
    }
}

fn about(options: &SimulateOptions, world: &World, path: &DrivePath) -> About {
    let values = [
        ("program", concat!("biplane-mock ", env!("CARGO_PKG_VERSION"), " simulate").to_owned()),
        ("world", world.name.clone()),
        ("path", path.name.clone()),
        ("seed", options.seed.to_string()),
        ("origin", "synthetic".to_owned()),
    ];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>();
    About { name: "biplane-mock".to_owned(), values }
}

#[cfg(test)]
mod tests;
