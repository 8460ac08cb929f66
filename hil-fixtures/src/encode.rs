//! Scans and odometry as the bytes that devices would have sent: a capture from an import or a recording.
//!
//! The inverse of the onboard time model: a scan's telegram begins k mirror turns after its stamp, an odometry packet at its stamp.
//! A line carries one byte after another: a telegram whose time comes while the line is still busy, because stamps
//! step back or stand too close for the line's rate, follows when the line is free, and is counted as delayed. No scan is left
//! out; an odometry sample is, when the base's line is so far behind that the next one is due.
//! Ranges in whole units of the rig; +inf becomes "no echo" (8191), other values that are no range become "read error" (8186).

use crate::capture_file::{About, LineReads, write_capture};
use crate::line::{Adapter, ReadParams, laser_byte_ns, transfer_ns};
use crate::odometry::{OdometryParams, theta_steps, ticks};
use crate::scanner::{BEYOND_RANGE, LARGEST_VALUE, NO_ECHO, READ_ERROR, Variant};
use crate::simulated_rig::{counts_mm, variant_of};
use crate::source::{OdometrySample, ScanWords};
use crate::telegrams;
use biplane_recording::msg::{LaserScan, Odometry};
use biplane_recording::rig::{BaseProtocol, Laser};
use biplane_recording::{AnyMessage, Port, ReadError, Reader, Rig, RigError, Topic, WriteError};
use biplane_wire::WireError;
use std::collections::BTreeMap;
use std::path::PathBuf;

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
    /// A base whose packets are not known here.
    #[error("base.protocol = {found} of the rig cannot be encoded: p2os can")]
    Base {
        /// The protocol.
        found: &'static str,
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
    let reader = Reader::open(&options.input)?;
    let given = options.rig.as_deref().map(Rig::load).transpose()?;
    let fixed = given.is_some();
    let mut rig = match given {
        Some(rig) => rig,
        None => reader.rig()?.unwrap_or_default(),
    };
    if rig.base.protocol != BaseProtocol::P2os {
        return Err(EncodeError::Base { found: rig.base.protocol.name() });
    }
    let mut report = EncodeReport::default();
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
        LineReads { port: Port::Horizontal, reads: horizontal.line.adapter.finish() },
        LineReads { port: Port::Vertical, reads: vertical.line.adapter.finish() },
        LineReads { port: Port::Base, reads: base.line.adapter.finish() },
    ];
    write_capture(&options.output, options.overwrite, &rig, &about(options), &lines, 0)?;
    Ok(report)
}

fn about(options: &EncodeOptions) -> About {
    let input = options.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let program = concat!("biplane-mock ", env!("CARGO_PKG_VERSION"), " encode").to_owned();
    let values = [("program", program), ("input", input)];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>();
    About { name: "biplane-mock".to_owned(), values }
}

/// A line that carries one telegram after another.
struct BusyLine {
    adapter: Adapter,
    free_ns: i64,
    last_stamp_ns: i64,
}

impl BusyLine {
    fn new(options: &EncodeOptions, line: u64) -> Self {
        let adapter = Adapter::new(options.reads, options.seed, line);
        Self { adapter, free_ns: i64::MIN, last_stamp_ns: i64::MIN }
    }

    /// Sends `bytes` at `due_ns` or when the line is free; `arrival_ns` is a byte's time after the first bit.
    fn send(&mut self, bytes: &[u8], due_ns: i64, byte_ns: i64, arrival_ns: impl Fn(usize) -> i64) -> i64 {
        let start_ns = due_ns.max(self.free_ns);
        for (index, byte) in bytes.iter().enumerate() {
            self.free_ns = start_ns + arrival_ns(index);
            self.adapter.push(*byte, self.free_ns, byte_ns);
        }
        start_ns - due_ns
    }

    fn count(&mut self, stamp_ns: i64, delay_ns: i64, report: &mut EncodeReport) {
        report.backward_stamps += u64::from(stamp_ns < self.last_stamp_ns);
        self.last_stamp_ns = stamp_ns;
        report.delayed += u64::from(delay_ns > 0);
        report.longest_delay_ms = report.longest_delay_ms.max(delay_ns as f64 * 1e-6);
    }
}

struct LaserLine {
    line: BusyLine,
    topic: Topic,
    /// The rig was given: scans must be as it says.
    fixed: bool,
    sent: u64,
}

impl LaserLine {
    fn new(options: &EncodeOptions, topic: Topic, fixed: bool, line: u64) -> Self {
        Self { line: BusyLine::new(options, line), topic, fixed, sent: 0 }
    }

    /// Sends a scan. The first one sets the laser's variant, unless the rig was given.
    fn send(
        &mut self,
        scan: &LaserScan,
        laser: &mut Laser,
        report: &mut EncodeReport,
    ) -> Result<(), EncodeError> {
        let variant = variant_of_scan(scan).ok_or_else(|| self.not_lms(scan, KNOWN.to_owned()))?;
        if self.sent == 0 && !self.fixed {
            laser.fov_deg = variant.fov_deg();
            laser.resolution_deg = f64::from(variant.resolution_cdeg()) / 100.0;
        }
        if variant_of(laser) != Some(variant) {
            let expected = format!("{} degrees in steps of {}", laser.fov_deg, laser.resolution_deg);
            return Err(self.not_lms(scan, expected));
        }
        let bytes = telegrams::scan(&words(scan, variant, laser, report), counts_mm(laser))?;
        let delay_ns = variant.duration_ns() + (laser.delay_ms * 1e6).round() as i64;
        let arrival_ns = |index| laser_byte_ns(index, laser.baud);
        let wait_ns =
            self.line.send(&bytes, scan.stamp_ns + delay_ns, transfer_ns(1, laser.baud), arrival_ns);
        self.line.count(scan.stamp_ns, wait_ns, report);
        self.sent += 1;
        Ok(())
    }

    fn not_lms(&self, scan: &LaserScan, expected: String) -> EncodeError {
        EncodeError::NotLms {
            topic: self.topic.name(),
            number: self.sent,
            beams: scan.ranges_m.len(),
            first_deg: f64::from(scan.angle_min_rad).to_degrees(),
            step_deg: f64::from(scan.angle_increment_rad).to_degrees(),
            expected,
        }
    }
}

const KNOWN: &str =
    "180 degrees in steps of 0.5 or 1, 100 degrees in steps of 0.25, 0.5 or 1, or 90 degrees in steps of 0.5";

/// The variant that a scan was taken with. The last beam may be missing: CARMEN logs hold 180 beams of 181.
#[must_use]
pub fn variant_of_scan(scan: &LaserScan) -> Option<Variant> {
    let step_deg = f64::from(scan.angle_increment_rad).to_degrees();
    let first_deg = f64::from(scan.angle_min_rad).to_degrees();
    [(180, 100), (180, 50), (100, 100), (100, 50), (100, 25), (90, 50)]
        .into_iter()
        .filter_map(|(fov_deg, resolution_cdeg)| Variant::new(fov_deg, resolution_cdeg))
        .find(|variant| {
            let own_step = f64::from(variant.resolution_cdeg()) / 100.0;
            let full = usize::from(variant.beam_count());
            (scan.ranges_m.len() == full || scan.ranges_m.len() + 1 == full)
                && (step_deg - own_step).abs() < 0.01 * own_step
                && (first_deg + 0.5 * f64::from(variant.fov_deg())).abs() < 0.5 * own_step
        })
}

/// Value words; a missing last beam has no echo.
fn words(scan: &LaserScan, variant: Variant, laser: &Laser, report: &mut EncodeReport) -> ScanWords {
    let mut words: ScanWords = ScanWords::new();
    for range_m in scan.ranges_m.iter().take(usize::from(variant.beam_count())) {
        let steps = (f64::from(*range_m) / laser.units.metres()).round();
        let word = if *range_m == f32::INFINITY {
            NO_ECHO
        } else if steps > f64::from(LARGEST_VALUE) {
            report.beyond_range += 1;
            BEYOND_RANGE
        } else if steps >= 0.0 {
            steps as u16
        } else {
            READ_ERROR
        };
        // At most as many as the variant has beams, and those fit.
        let _ = words.push(word);
    }
    while words.len() < usize::from(variant.beam_count()) && words.push(NO_ECHO).is_ok() {}
    words
}

struct BaseLine {
    line: BusyLine,
    baud: u32,
    metres_per_tick: f64,
}

impl BaseLine {
    fn new(options: &EncodeOptions, rig: &Rig) -> Self {
        let line = BusyLine::new(options, 2);
        Self { line, baud: rig.base.baud, metres_per_tick: rig.base.metres_per_tick }
    }

    fn send(&mut self, odometry: &Odometry, report: &mut EncodeReport) -> Result<(), EncodeError> {
        let packet = telegrams::odometry(&sample(odometry, self.metres_per_tick))?;
        // A packet that would start after the following one is due would only make all later ones late.
        if self.line.free_ns > odometry.stamp_ns.saturating_add(2 * transfer_ns(packet.len(), self.baud)) {
            report.odometry_skipped += 1;
            return Ok(());
        }
        let arrival_ns = |index| transfer_ns(index + 1, self.baud);
        let wait_ns = self.line.send(&packet, odometry.stamp_ns, transfer_ns(1, self.baud), arrival_ns);
        self.line.count(odometry.stamp_ns, wait_ns, report);
        report.odometry += 1;
        Ok(())
    }
}

/// What the base would have reported.
fn sample(odometry: &Odometry, metres_per_tick: f64) -> OdometrySample {
    let [x, y, z, w] = odometry.orientation_xyzw;
    let heading_rad = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let (forward, turn) = (odometry.linear_m_s[0], odometry.angular_rad_s[2]);
    let aside = 0.5 * OdometryParams::default().track_m * turn;
    let mm_s = |speed_m_s: f64| (speed_m_s * 1000.0).round().clamp(-32768.0, 32767.0) as i16;
    OdometrySample {
        x_raw: ticks(odometry.position_m[0], metres_per_tick),
        y_raw: ticks(odometry.position_m[1], metres_per_tick),
        theta_raw: theta_steps(heading_rad),
        left_mm_s: mm_s(forward - aside),
        right_mm_s: mm_s(forward + aside),
        moving: forward != 0.0 || turn != 0.0,
    }
}

#[cfg(test)]
mod tests;
