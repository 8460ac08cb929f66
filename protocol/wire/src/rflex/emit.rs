//! Putting the frame around the data of a packet.

use super::framing::{DATA_OFFSET, OVERHEAD};
use super::{HEADER, TRAILER, checksum};
use crate::WireError;
use crate::cursor::Writer;

/// Writes the frame around the data and returns the packet's length.
pub(crate) fn emit(
    port: u8,
    id: u8,
    opcode: u8,
    out: &mut [u8],
    data: impl Fn(&mut Writer<'_>),
) -> Result<usize, WireError> {
    let count = Writer::measure(&data);
    let length = u8::try_from(count).map_err(|_| WireError::Capacity {
        field: "data",
        limit: usize::from(u8::MAX),
        found: count,
        offset: DATA_OFFSET,
    })?;
    let (needed, found) = (OVERHEAD + count, out.len());
    let frame = out.get_mut(..needed).ok_or(WireError::BufferTooSmall { needed, found })?;
    let mut writer = Writer::new(frame);
    writer.bytes(&HEADER);
    writer.bytes(&[port, id, opcode, length]);
    data(&mut writer);
    let body = writer.finish()?;
    let sum = checksum(body.get(HEADER.len()..).unwrap_or_default());
    if let Some(end) = frame.last_chunk_mut() {
        *end = [sum, TRAILER[0], TRAILER[1]];
    }
    Ok(needed)
}
