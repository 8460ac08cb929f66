//! What is encoded, what came of it, and why it could not be.

use crate::devices::cola::ColaParams;
use crate::devices::scip::ScipParams;
use crate::line::ReadParams;
use biplane_recording::{Port, ReadError, RigError, Topic, WriteError};
use biplane_wire::WireError;
use std::path::PathBuf;

/// What to encode, and where to.
#[derive(Clone, Debug)]
pub struct EncodeOptions {
    /// An import or a recording.
    pub input: PathBuf,
    /// The capture.
    pub output: PathBuf,
    /// The rig whose lines carry the bytes; else the input's own, else the template with the scans' field of
    /// view.
    pub rig: Option<PathBuf>,
    /// Replace an existing capture.
    pub overwrite: bool,
    /// The lasers of a rig that are on the network.
    pub network_laser: ColaParams,
    /// The Hokuyo lasers of a rig.
    pub hokuyo: ScipParams,
    /// How the bytes reach the computer; without lateness by default.
    pub reads: ReadParams,
    /// Of the lateness.
    pub seed: u64,
}

impl Default for EncodeOptions {
    fn default() -> Self {
        let reads = ReadParams { lateness_mean_ms: 0.0, hiccup_share: 0.0, ..ReadParams::default() };
        Self {
            input: PathBuf::new(),
            output: PathBuf::from("capture.mcap"),
            rig: None,
            overwrite: false,
            network_laser: ColaParams::default(),
            hokuyo: ScipParams::default(),
            reads,
            seed: 1,
        }
    }
}

/// What was encoded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeReport {
    /// Telegrams of the localizing laser.
    pub scans_horizontal: u64,
    /// Telegrams of the building-facing laser.
    pub scans_vertical: u64,
    /// Packets of the base.
    pub odometry: u64,
    /// Odometry samples that the base's line had no time for.
    pub odometry_skipped: u64,
    /// Telegrams and packets that had to wait for their line.
    pub delayed: u64,
    /// The longest wait, milliseconds.
    pub longest_delay_ms: f64,
    /// Stamps earlier than the one before on the same topic.
    pub backward_stamps: u64,
    /// Samples of an inertial unit that are kept.
    pub inertial: u64,
    /// Ranges too long for the rig's unit, or for the laser, sent as "beyond range" or "no echo".
    pub beyond_range: u64,
    /// Lines that were raised to a faster rate, with that rate in Bd: stamps stand too close for the rig's
    /// own.
    pub raised: Vec<(Port, u32)>,
}

/// Why a file could not be encoded.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// The input.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The rig file.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The capture.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Nothing to encode.
    #[error("{} holds no scans (topic {})", path.display(), Topic::ScanHorizontal.name())]
    NoScans {
        /// The input.
        path: PathBuf,
    },
    /// A scan that the laser of the rig does not send.
    #[error(
        "scan {number} of {topic} (counted from 0): {beams} beams from {first_deg:.2} degrees in steps of {step_deg:.3} are no {laser} scan; expected {expected}"
    )]
    OtherLaser {
        /// What the laser is.
        laser: &'static str,
        /// The topic.
        topic: &'static str,
        /// Index of the scan on it.
        number: u64,
        /// How many beams.
        beams: usize,
        /// Direction of the first one.
        first_deg: f64,
        /// Step between them.
        step_deg: f64,
        /// What that laser, or the rig, has.
        expected: String,
    },
    /// A telegram.
    #[error("a telegram could not be put together: {0:?}")]
    Telegram(WireError),
}

impl From<WireError> for EncodeError {
    fn from(error: WireError) -> Self {
        Self::Telegram(error)
    }
}
