//! What a unit sends in its measurements, and how often.

use heapless::Vec;

use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Most outputs of a configuration.
pub const MAX_OUTPUTS: usize = 32;
/// The rate of what comes with every measurement: counters, times, flags.
pub const EVERY_SAMPLE: u16 = 0xFFFF;

/// One output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The identifier of its items.
    pub identifier: u16,
    /// Measurements a second, or [`EVERY_SAMPLE`].
    pub rate_hz: u16,
}

/// All outputs.
pub type Outputs = Vec<Output, MAX_OUTPUTS>;

pub(super) fn read(data: &[u8], offset: usize) -> Result<Outputs, WireError> {
    let mut reader = Reader::new(data, offset);
    let mut outputs = Outputs::new();
    while reader.remaining() > 0 {
        let output = Output { identifier: reader.be_u16()?, rate_hz: reader.be_u16()? };
        outputs.push(output).map_err(|_| WireError::Capacity {
            field: "outputs",
            limit: MAX_OUTPUTS,
            found: data.len() / 4,
            offset,
        })?;
    }
    Ok(outputs)
}

pub(super) fn write(outputs: &Outputs, writer: &mut Writer<'_>) {
    for output in outputs {
        writer.bytes(&output.identifier.to_be_bytes());
        writer.bytes(&output.rate_hz.to_be_bytes());
    }
}
