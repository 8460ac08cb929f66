//! Putting the frame around the data of a message.

use super::framing::{DATA_OFFSET, EXTENDED, EXTENDED_DATA_OFFSET, MAX_DATA_BYTES, MIN_EXTENDED_BYTES};
use super::{PREAMBLE, checksum};
use crate::WireError;
use crate::cursor::Writer;

/// Where so many data bytes begin in their message.
pub(crate) fn data_offset(count: usize) -> usize {
    if count < MIN_EXTENDED_BYTES { DATA_OFFSET } else { EXTENDED_DATA_OFFSET }
}

/// Bytes of a message with so many data bytes.
pub(crate) fn message_bytes(count: usize) -> usize {
    data_offset(count) + count + 1
}

/// Writes the frame around the data and returns the message's length.
pub(crate) fn emit(mid: u8, out: &mut [u8], data: impl Fn(&mut Writer<'_>)) -> Result<usize, WireError> {
    let count = Writer::measure(&data);
    let length = u16::try_from(count).ok().filter(|_| count <= MAX_DATA_BYTES);
    let length = length.ok_or(WireError::Capacity {
        field: "data",
        limit: MAX_DATA_BYTES,
        found: count,
        offset: DATA_OFFSET,
    })?;
    let (needed, found) = (message_bytes(count), out.len());
    let frame = out.get_mut(..needed).ok_or(WireError::BufferTooSmall { needed, found })?;
    let mut writer = Writer::new(frame);
    writer.bytes(&PREAMBLE);
    writer.u8(mid);
    match u8::try_from(length) {
        Ok(length) if length != EXTENDED => writer.u8(length),
        _ => {
            writer.u8(EXTENDED);
            writer.bytes(&length.to_be_bytes());
        }
    }
    data(&mut writer);
    let body = writer.finish()?;
    let sum = checksum(body.get(1..).unwrap_or_default());
    if let Some(end) = frame.last_mut() {
        *end = sum;
    }
    Ok(needed)
}
