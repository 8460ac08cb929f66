//! Serial captures as files: the reads of all lines in order of time, with the rig that they belong to.

use crate::faults::clock_step::HostClock;
use crate::line::SerialRead;
use biplane_recording::mcap::read::RIG_ATTACHMENT;
use biplane_recording::messages::Imu;
use biplane_recording::{Direction, Port, Rig, Topic, WriteError, WriteReport, Writer, WriterOptions};
use std::collections::BTreeMap;
use std::path::Path;

/// The reads of one line in one direction; of what a host sends, the writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineReads {
    /// Whose line.
    pub port: Port,
    /// From the device or to it.
    pub direction: Direction,
    /// In order of time.
    pub reads: Vec<SerialRead>,
}

impl LineReads {
    /// What a device sends.
    #[must_use]
    pub fn received(port: Port, reads: Vec<SerialRead>) -> Self {
        Self { port, direction: Direction::Rx, reads }
    }

    /// What the host sends to a device.
    #[must_use]
    pub fn sent(port: Port, writes: Vec<SerialRead>) -> Self {
        Self { port, direction: Direction::Tx, reads: writes }
    }
}

/// What the file says about itself.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Name of the metadata record.
    pub name: String,
    /// What it holds.
    pub values: BTreeMap<String, String>,
}

/// Samples of an inertial unit that come with the capture, not as bytes: each with when it was taken and when
/// it came, in the run's time, nanoseconds.
pub type InertialReads = Vec<([i64; 2], Imu)>;

/// Writes a capture; `clock` stamps the reads, each when it returned, also when it steps back.
pub fn write_capture(
    path: &Path,
    overwrite: bool,
    rig: &Rig,
    about: &About,
    (lines, inertial): (&[LineReads], InertialReads),
    clock: &mut HostClock,
) -> Result<WriteReport, WriteError> {
    let mut writer =
        Writer::create(path, &WriterOptions { overwrite, in_order: false, ..WriterOptions::default() })?;
    writer.attach(RIG_ATTACHMENT, "application/toml", rig.to_toml().as_bytes())?;
    writer.metadata(&about.name, &about.values)?;
    let mut next = vec![0_usize; lines.len()];
    let mut inertial = inertial.into_iter().peekable();
    loop {
        // The earliest read; of equal ones the first line's.
        let waiting =
            lines.iter().enumerate().filter_map(|(i, line)| Some((line.reads.get(next[i])?.time_ns, i)));
        let Some((_, i)) = waiting.min() else { break };
        let read = &lines[i].reads[next[i]];
        while let Some(([taken_ns, came_ns], mut sample)) =
            inertial.next_if(|([_, came_ns], _)| *came_ns <= read.time_ns)
        {
            sample.stamp_ns = clock.utc_ns(taken_ns);
            writer.write(Topic::Imu, clock.utc_ns(came_ns), sample.stamp_ns, &sample)?;
        }
        writer.write_serial(lines[i].port, lines[i].direction, clock.utc_ns(read.time_ns), &read.bytes)?;
        next[i] += 1;
    }
    writer.finish()
}
