//! Putting the frame around the body of a packet.

use super::{HEADER, checksum};
use crate::WireError;
use crate::cursor::Writer;

/// Header and length byte.
pub(crate) const BODY_OFFSET: usize = 3;

/// Length of the whole packet around a body.
pub(crate) fn framed_len(body: impl FnOnce(&mut Writer<'_>)) -> usize {
    BODY_OFFSET + Writer::measure(body) + 2
}

/// Writes the frame around a body and returns the packet's length.
pub(crate) fn emit(out: &mut [u8], body: impl Fn(&mut Writer<'_>)) -> Result<usize, WireError> {
    let total = framed_len(&body);
    let length = u8::try_from(total - BODY_OFFSET).map_err(|_| WireError::Capacity {
        field: "packet length",
        limit: usize::from(u8::MAX),
        found: total - BODY_OFFSET,
        offset: 2,
    })?;
    let found = out.len();
    let frame = out.get_mut(..total).ok_or(WireError::BufferTooSmall { needed: total, found })?;
    let mut writer = Writer::new(frame);
    writer.bytes(&HEADER);
    writer.u8(length);
    body(&mut writer);
    let written = writer.finish()?;
    let sum = checksum(written.get(BODY_OFFSET..).unwrap_or(&[]));
    if let Some(end) = frame.last_chunk_mut() {
        *end = sum.to_be_bytes();
    }
    Ok(total)
}
