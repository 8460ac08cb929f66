//! Why a run could not be made. One sentence each, naming what and where.

use std::io::ErrorKind;
use std::path::PathBuf;

use crate::types::live_address::LiveAddress;
use biplane_recording::{ReadError, RigError, WriteError};

/// Two devices on one port.
#[derive(Debug, thiserror::Error)]
#[error("{port} is the port of {} and of {}: each device needs its own", devices[0], devices[1])]
pub struct SharedPort {
    /// Its path.
    pub port: String,
    /// The devices.
    pub devices: [&'static str; 2],
}

/// Why a run could not be made.
#[derive(Debug, thiserror::Error)]
pub enum OnboardError {
    /// The rig is not one.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The input cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// No room is left for a recording that is under way.
    #[error(
        "disk full while writing {}: what was written before is kept, and `biplane-onboard salvage` makes it whole",
        path.display()
    )]
    DiskFull {
        /// The unfinished file.
        path: PathBuf,
    },
    /// A list of pairs is none.
    #[error(transparent)]
    Pairs(#[from] PairsError),
    /// A scan of a list is not in the recording.
    #[error("{} holds no scan of the horizontal laser within 6 ms of {}.{:09}", path.display(), stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000)]
    NoScanAt {
        /// The recording.
        path: PathBuf,
        /// The stamp, nanoseconds.
        stamp_ns: i64,
    },
    /// The input carries no rig and none was given.
    #[error("{} carries no rig.toml, and none was given with --rig", path.display())]
    NoRig {
        /// The input.
        path: PathBuf,
    },
    /// The input holds neither serial bytes nor scans.
    #[error("{} holds neither serial bytes of a laser nor scans of one: nothing to replay", path.display())]
    NothingToReplay {
        /// The input.
        path: PathBuf,
    },
    /// A folder cannot be worked in, or a port not be looked up.
    #[error("{}: {source}", path.display())]
    Place {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Serial ports cannot be opened.
    #[error("{}", refused.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Ports {
        /// Why, of each.
        refused: Vec<PortRefused>,
    },
    /// The run was stopped before all its ports were there.
    #[error("stopped while waiting for {}: nothing was recorded", names(missing))]
    StoppedWaiting {
        /// The ports that were not there.
        missing: Vec<PortRefused>,
    },
    /// The output's folder is missing.
    #[error("there is no folder {}: make it first (mkdir -p {})", folder.display(), folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// The output's folder is one of the kernel's own.
    #[error("{} is on no disk: nothing can be recorded there", folder.display())]
    NoDisk {
        /// The folder.
        folder: PathBuf,
    },
    /// Too little room to begin.
    #[error(
        "only {} MB are left on the disk of {}, and {} MB are needed to begin",
        free_bytes / 1_000_000,
        folder.display(),
        needed_bytes / 1_000_000
    )]
    DiskLow {
        /// Where the recording would lie.
        folder: PathBuf,
        /// What is free there.
        free_bytes: u64,
        /// With less, no recording begins.
        needed_bytes: u64,
    },
    /// The run was stopped before there was room for it.
    #[error("stopped while waiting for room on the disk of {}: nothing was recorded", folder.display())]
    StoppedWaitingForRoom {
        /// Where the recording would lie.
        folder: PathBuf,
    },
    /// The address of the live view cannot be had.
    #[error(
        "cannot serve a live view at {address}: {source}{}",
        live_hint(*address, source)
    )]
    LiveView {
        /// The address.
        address: LiveAddress,
        /// What the system said.
        source: std::io::Error,
    },
    /// The program was built without the live view.
    #[error(
        "this program was built without the live view (feature `live` of biplane-onboard): leave out --live"
    )]
    NoLiveView,
    /// A device was named that the rig has not, or on no port.
    #[error("there is no {device} to ask: {why}")]
    NotInRig {
        /// The device.
        device: &'static str,
        /// What is missing in the rig.
        why: &'static str,
    },
    /// Devices that share ports.
    #[error("{}", shared.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    SharedPorts {
        /// Each device with one before it on the same port.
        shared: Vec<SharedPort>,
    },
    /// A recording of a base whose answers only mean something with their questions, without the questions.
    #[error(
        "{} holds what a {protocol} base answered, but not what it was asked (/serial/base/tx): its answers cannot be read; \
         record with --raw, which keeps both, or replay a file without /serial/base/rx",
        path.display()
    )]
    NoQuestions {
        /// The input.
        path: PathBuf,
        /// The protocol's name.
        protocol: &'static str,
    },
    /// The run ended without a single scan of the laser that localizes.
    #[error("no scan from the horizontal laser on {port} in the whole run; {} holds no pose", output.display())]
    NoScans {
        /// The laser's port.
        port: String,
        /// The recording that was made all the same.
        output: PathBuf,
    },
    /// A replay made no pose.
    #[error(
        "no scan of the horizontal laser in {} could be posed; {} keeps what there was, and holds no pose",
        input.display(),
        output.display()
    )]
    NoPoses {
        /// What was replayed.
        input: PathBuf,
        /// The recording that was made all the same.
        output: PathBuf,
    },
    /// A thread could not be started, or a signal handler not be set.
    #[error("cannot {what}: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
}

/// A list of pairs that is none.
#[derive(Debug, thiserror::Error)]
pub enum PairsError {
    /// It cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The list.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A line is not five numbers.
    #[error("{} line {line}: expected stamp_a stamp_b x y theta, found \"{found}\"", path.display())]
    Line {
        /// The list.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Its text.
        found: String,
    },
    /// It names no pair.
    #[error("{} names no pair", path.display())]
    Empty {
        /// The list.
        path: PathBuf,
    },
}

/// A serial port that cannot be opened.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error, serde::Serialize)]
#[error("cannot open {port} ({device}): {reason}")]
pub struct PortRefused {
    /// Its path.
    pub port: String,
    /// Which device it belongs to.
    pub device: &'static str,
    /// What the system said, in words.
    pub reason: String,
}

/// What to do about an address that cannot be had.
fn live_hint(address: LiveAddress, source: &std::io::Error) -> String {
    let ip = address.socket().ip();
    match source.kind() {
        ErrorKind::AddrInUse => {
            format!(" (is another recording there? --live {ip}:PORT takes another port)")
        }
        ErrorKind::AddrNotAvailable => format!(
            " ({ip} is no address of this machine: `ip address` lists them; --live 127.0.0.1 is for viewers on it, --live 0.0.0.0 for \
             all networks)"
        ),
        ErrorKind::PermissionDenied => format!(" (ports below 1024 need a right: --live {ip}:8765)"),
        _ => String::new(),
    }
}

/// Ports with their devices, for a sentence.
pub(crate) fn names(ports: &[PortRefused]) -> String {
    let names = ports.iter().map(|port| format!("{} ({})", port.port, port.device));
    names.collect::<Vec<_>>().join(", ")
}
