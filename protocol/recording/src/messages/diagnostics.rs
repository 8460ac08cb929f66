//! `diagnostic_msgs/msg/DiagnosticArray`: the health of a run, once a second.

use super::Message;
use crate::messages::cdr::{CdrError, Decoder, Encoder};

/// One named figure.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct KeyValue {
    /// Its name, with the unit where it has one.
    pub key: String,
    /// Its value as text.
    pub value: String,
}

/// The state of one part.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct DiagnosticStatus {
    /// One of [`DiagnosticStatus::OK`], [`DiagnosticStatus::WARN`], [`DiagnosticStatus::ERROR`],
    /// [`DiagnosticStatus::STALE`].
    pub level: u8,
    /// The part.
    pub name: String,
    /// Its state in words.
    pub message: String,
    /// The device, for example its port.
    pub hardware_id: String,
    /// Figures.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// All is well.
    pub const OK: u8 = 0;
    /// Works, with something to look at.
    pub const WARN: u8 = 1;
    /// Does not work.
    pub const ERROR: u8 = 2;
    /// Nothing heard for a while.
    pub const STALE: u8 = 3;
}

/// The state of all parts.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct DiagnosticArray {
    /// The moment of the report, in ns.
    pub stamp_ns: i64,
    /// Mostly empty.
    pub frame_id: String,
    /// One a part.
    pub status: Vec<DiagnosticStatus>,
}

/// The least bytes a status takes: level and padding 4, three empty strings 4 each, count 4.
const STATUS_MIN_SIZE: usize = 4 + 12 + 4;
/// The least bytes a figure takes: two empty strings.
const KEY_VALUE_MIN_SIZE: usize = 8;

fn write_status(status: &DiagnosticStatus, encoder: &mut Encoder) {
    encoder.u8(status.level);
    encoder.string(&status.name);
    encoder.string(&status.message);
    encoder.string(&status.hardware_id);
    encoder.count(status.values.len());
    for figure in &status.values {
        encoder.string(&figure.key);
        encoder.string(&figure.value);
    }
}

fn read_status(decoder: &mut Decoder) -> Result<DiagnosticStatus, CdrError> {
    let level = decoder.u8()?;
    let name = decoder.string()?;
    let message = decoder.string()?;
    let hardware_id = decoder.string()?;
    let count = decoder.count(KEY_VALUE_MIN_SIZE)?;
    let mut values = Vec::with_capacity(count);
    for _ in 0..count {
        values.push(KeyValue { key: decoder.string()?, value: decoder.string()? });
    }
    Ok(DiagnosticStatus { level, name, message, hardware_id, values })
}

impl Message for DiagnosticArray {
    const TYPE: &'static str = "diagnostic_msgs/msg/DiagnosticArray";

    fn write(&self, encoder: &mut Encoder) {
        encoder.header(self.stamp_ns, &self.frame_id);
        encoder.count(self.status.len());
        for status in &self.status {
            write_status(status, encoder);
        }
    }

    fn read(decoder: &mut Decoder) -> Result<Self, CdrError> {
        let (stamp_ns, frame_id) = decoder.header()?;
        // The first status may begin unaligned, so its padding may be missing.
        let count = decoder.count(STATUS_MIN_SIZE - 3)?;
        let mut status = Vec::with_capacity(count);
        for _ in 0..count {
            status.push(read_status(decoder)?);
        }
        Ok(Self { stamp_ns, frame_id, status })
    }
}
