//! Scans and odometry as the bytes that devices would have sent: a capture from an import or a recording.
//!
//! The inverse of the onboard time model: a scan's telegram begins k mirror turns after its stamp, an odometry packet at its stamp.
//! A line carries one byte after another: a telegram whose time comes while the line is still busy, because stamps
//! step back or stand too close for the line's rate, follows when the line is free, and is counted as delayed. A line whose stamps
//! crowd it is raised to a faster rate first, unless the rig was given. No scan is left out; an odometry sample is, when the base's
//! line is so far behind that the next one is due.
//! Ranges in whole units of the rig; +inf becomes "no echo" (8191), other values that are no range become "read error" (8186).

use crate::capture_file::{About, LineReads, write_capture};
use crate::faults::clock_step::HostClock;
use crate::line::ReadParams;
use crate::same_file::{SameFile, refuse_same_file};
use base::BaseLine;
use biplane_recording::rig::Laser;
use biplane_recording::{AnyMessage, Port, ReadError, Reader, Rig, RigError, Topic, WriteError};
use biplane_wire::WireError;
use laser::LaserLine;
use std::collections::BTreeMap;
use std::path::PathBuf;

mod base;
mod busy_line;
mod laser;
mod rates;

/// What to encode, and where to.
#[derive(Clone, Debug)]
pub struct EncodeOptions {
    /// An import or a recording.
    pub input: PathBuf,
    /// The capture.
    pub output: PathBuf,
    /// The rig whose lines carry the bytes; else the input's own, else the template with the scans' field of view.
    pub rig: Option<PathBuf>,
    /// Replace an existing capture.
    pub overwrite: bool,
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
            reads,
            seed: 1,
        }
    }
}

/// What was encoded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EncodeReport {
    /// Telegrams of the localising laser.
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
    /// Ranges too long for the rig's unit, sent as "beyond range".
    pub beyond_range: u64,
    /// Lines that were raised to a faster rate, with that rate in Bd: stamps stand too close for the rig's own.
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
    /// The output is the input.
    #[error(transparent)]
    SameFile(#[from] SameFile),
    /// Nothing to encode.
    #[error("{} holds no scans (topic {})", path.display(), Topic::ScanHorizontal.name())]
    NoScans {
        /// The input.
        path: PathBuf,
    },
    /// A scan that no LMS sends.
    #[error(
        "scan {number} of {topic} (counted from 0): {beams} beams from {first_deg:.2} degrees in steps of {step_deg:.3} are no LMS 2xx scan; expected {expected}"
    )]
    NotLms {
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
        /// What an LMS, or the rig, has.
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

/// Encodes and writes the capture.
pub fn run(options: &EncodeOptions) -> Result<EncodeReport, EncodeError> {
    for input in [Some(&options.input), options.rig.as_ref()].into_iter().flatten() {
        refuse_same_file(input, &options.output)?;
    }
    let reader = Reader::open(&options.input)?;
    let given = options.rig.as_deref().map(Rig::load).transpose()?;
    let fixed = given.is_some();
    let mut rig = match given {
        Some(rig) => rig,
        None => reader.rig()?.unwrap_or_default(),
    };
    let mut report = EncodeReport::default();
    if !fixed {
        report.raised = rates::raise(&reader, &mut rig)?;
    }
    let mut horizontal = LaserLine::new(options, Topic::ScanHorizontal, fixed, 0);
    let mut vertical = LaserLine::new(options, Topic::ScanVertical, fixed, 1);
    let mut base = BaseLine::new(options, &rig);
    for entry in reader.messages() {
        let entry = entry?;
        match (entry.topic, entry.decode()?) {
            (Some(Topic::ScanHorizontal), AnyMessage::Scan(scan)) => {
                horizontal.send(&scan, &mut rig.horizontal, &mut report)?;
                report.scans_horizontal += 1;
            }
            (Some(Topic::ScanVertical), AnyMessage::Scan(scan)) => {
                vertical.send(&scan, rig.vertical.get_or_insert_with(Laser::vertical), &mut report)?;
                report.scans_vertical += 1;
            }
            (Some(Topic::Odom), AnyMessage::Odometry(odometry)) => base.send(&odometry, &mut report)?,
            _ => {}
        }
    }
    if report.scans_horizontal == 0 {
        return Err(EncodeError::NoScans { path: options.input.clone() });
    }
    if report.scans_vertical == 0 && !fixed {
        rig.vertical = None;
    }
    let lines = [
        LineReads::received(Port::Horizontal, horizontal.line.adapter.finish()),
        LineReads::received(Port::Vertical, vertical.line.adapter.finish()),
        LineReads::sent(Port::Base, base.asked),
        LineReads::received(Port::Base, base.line.adapter.finish()),
    ];
    write_capture(
        &options.output,
        options.overwrite,
        &rig,
        &about(options),
        &lines,
        &mut HostClock::steady(0),
    )?;
    Ok(report)
}

fn about(options: &EncodeOptions) -> About {
    let input = options.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let program = concat!("biplane-mock ", env!("CARGO_PKG_VERSION"), " encode").to_owned();
    let values = [("program", program), ("input", input)];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>();
    About { name: "biplane-mock".to_owned(), values }
}

#[cfg(test)]
mod tests;
