//! From a recording to the capture: every message to its line, then all lines into one file.

use super::base::BaseLine;
use super::laser::LaserLine;
use super::rates;
use super::{EncodeError, EncodeOptions, EncodeReport};
use crate::capture::file::{About, LineReads, write_capture};
use crate::capture::same_file::refuse_same_file;
use crate::faults::clock_step::HostClock;
use biplane_recording::rig::Laser;
use biplane_recording::{AnyMessage, Port, Reader, Rig, Topic};
use std::collections::BTreeMap;

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
        (&lines, Vec::new()),
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
