//! `record`: the onboard process on a robot.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use biplane_matcher::Method;
use biplane_recording::Rig;

use crate::error::OnboardError;
use crate::report::RunReport;

/// What to record.
#[derive(Clone, PartialEq, Debug)]
pub struct RecordOptions {
    /// The robot.
    pub rig: Rig,
    /// The recording to make.
    pub output: PathBuf,
    /// How long; until stopped when `None`.
    pub duration: Option<Duration>,
    /// Record the serial bytes as well.
    pub raw: bool,
    /// How scans are matched.
    pub matcher: Method,
    /// Replace an existing output.
    pub overwrite: bool,
}

/// Records until the duration is over or `stop` is set.
///
/// # Errors
/// What is wrong with rig, ports or output.
pub fn record(options: &RecordOptions, stop: &AtomicBool) -> Result<RunReport, OnboardError> {
    let _ = stop;
    Err(OnboardError::Port {
        port: options.rig.horizontal.port.clone(),
        device: "horizontal laser",
        reason: "recording from serial ports is not built yet".to_owned(),
    })
}
