//! From a recording to the capture: every message to its line, then all lines into one file.

use super::base::BaseLine;
use super::fan_laser::{ColaLine, ScipLine};
use super::laser::LaserLine;
use super::rates;
use super::{EncodeError, EncodeOptions, EncodeReport};
use crate::capture::file::{About, InertialReads, LineReads, write_capture};
use crate::faults::clock_step::HostClock;
use biplane_recording::mcap::write::check_outputs;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::{Laser, LaserProtocol};
use biplane_recording::{AnyMessage, Port, Reader, Rig, Topic};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Encodes and writes the capture.
pub fn run(options: &EncodeOptions) -> Result<EncodeReport, EncodeError> {
    let read: Vec<PathBuf> =
        [Some(&options.input), options.rig.as_ref()].into_iter().flatten().cloned().collect();
    check_outputs(&[&options.output], &read, options.overwrite)?;
    let reader = Reader::open(&options.input)?;
    let given = options.rig.as_deref().map(Rig::load).transpose()?;
    let fixed = given.is_some();
    let mut rig = match given {
        Some(rig) => rig,
        None => reader.rig()?.unwrap_or_default(),
    };
    let mut report = EncodeReport::default();
    if !fixed {
        report.raised = rates::raise(&reader, &mut rig, &options.hokuyo)?;
    }
    let mut horizontal = AnyLine::new(options, Topic::ScanHorizontal, &rig.horizontal, fixed);
    let vertical_laser = rig.vertical.clone().unwrap_or_else(Laser::vertical);
    let mut vertical = AnyLine::new(options, Topic::ScanVertical, &vertical_laser, fixed);
    let mut base = BaseLine::new(options, &rig);
    let mut inertial = InertialReads::new();
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
            (Some(Topic::Imu), AnyMessage::Imu(sample)) => inertial.push(([sample.stamp_ns; 2], sample)),
            _ => {}
        }
    }
    if report.scans_horizontal == 0 {
        return Err(EncodeError::NoScans { path: options.input.clone() });
    }
    if report.scans_vertical == 0 && !fixed {
        rig.vertical = None;
    }
    inertial.sort_by_key(|(times_ns, _)| *times_ns);
    let [horizontal_asked, horizontal] = horizontal.finish(Port::Horizontal);
    let [vertical_asked, vertical] = vertical.finish(Port::Vertical);
    let lines = [
        horizontal_asked,
        horizontal,
        vertical_asked,
        vertical,
        LineReads::sent(Port::Base, base.asked),
        LineReads::received(Port::Base, base.line.adapter.finish()),
    ];
    let end_ns = lines.iter().filter_map(|line| line.reads.last()).map(|read| read.time_ns).max();
    report.inertial = inertial.iter().filter(|([_, came_ns], _)| Some(*came_ns) <= end_ns).count() as u64;
    write_capture(
        &options.output,
        options.overwrite,
        &rig,
        &about(options),
        (&lines, inertial),
        &mut HostClock::steady(0),
    )?;
    Ok(report)
}

/// The line of a laser of any kind.
enum AnyLine {
    Lms(LaserLine),
    Cola(Box<ColaLine>),
    Scip(Box<ScipLine>),
}

impl AnyLine {
    fn new(options: &EncodeOptions, topic: Topic, laser: &Laser, fixed: bool) -> Self {
        let line = u64::from(topic == Topic::ScanVertical);
        match &laser.protocol {
            LaserProtocol::Lms2xx => Self::Lms(LaserLine::new(options, topic, fixed, line)),
            LaserProtocol::Cola(_) => Self::Cola(Box::new(ColaLine::new(options, topic, line))),
            LaserProtocol::Scip(_) => Self::Scip(Box::new(ScipLine::new(options, topic, laser, line))),
        }
    }

    fn send(
        &mut self,
        scan: &LaserScan,
        laser: &mut Laser,
        report: &mut EncodeReport,
    ) -> Result<(), EncodeError> {
        match self {
            Self::Lms(line) => line.send(scan, laser, report),
            Self::Cola(line) => line.send(scan, laser, report),
            Self::Scip(line) => line.send(scan, laser, report),
        }
    }

    /// What it was asked, and what it sent.
    fn finish(self, port: Port) -> [LineReads; 2] {
        let (asked, line) = match self {
            Self::Lms(line) => (Vec::new(), line.line),
            Self::Cola(line) => (line.asked, line.line),
            Self::Scip(line) => (line.asked, line.line),
        };
        [LineReads::sent(port, asked), LineReads::received(port, line.adapter.finish())]
    }
}

fn about(options: &EncodeOptions) -> About {
    let input = options.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let program = concat!("biplane-mock ", env!("CARGO_PKG_VERSION"), " encode").to_owned();
    let values = [("program", program), ("input", input)];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<BTreeMap<_, _>>();
    About { name: "biplane-mock".to_owned(), values }
}
