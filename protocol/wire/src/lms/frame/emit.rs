//! Putting the frame around the body of a telegram, for both directions.

use super::layout::FRAME_OVERHEAD;
use super::{REPLY_BIT, STX, checksum};
use crate::WireError;
use crate::cursor::Writer;
use crate::lms::status::Status;

/// Length of the whole telegram around a body (code and data, without status).
pub(crate) fn framed_len(is_reply: bool, body: impl FnOnce(&mut Writer<'_>)) -> usize {
    FRAME_OVERHEAD + usize::from(is_reply) + Writer::measure(body)
}

/// Writes a whole telegram; `status` makes it a reply. Returns its length.
pub(crate) fn emit(
    out: &mut [u8],
    address: u8,
    status: Option<Status>,
    body: impl Fn(&mut Writer<'_>),
) -> Result<usize, WireError> {
    if (address & REPLY_BIT != 0) != status.is_some() {
        return Err(WireError::Direction { expect_reply: status.is_some(), found: address });
    }
    let total = framed_len(status.is_some(), &body);
    let found = out.len();
    let frame = out.get_mut(..total).ok_or(WireError::BufferTooSmall { needed: total, found })?;
    let length = total - FRAME_OVERHEAD;
    let length = u16::try_from(length).map_err(|_| WireError::Capacity {
        field: "telegram length",
        limit: usize::from(u16::MAX),
        found: length,
        offset: 2,
    })?;
    let mut writer = Writer::new(frame);
    writer.u8(STX);
    writer.u8(address);
    writer.u16(length);
    body(&mut writer);
    if let Some(status) = status {
        writer.u8(status.0);
    }
    let sum = checksum(writer.finish()?);
    if let Some(end) = frame.last_chunk_mut() {
        *end = sum.to_le_bytes();
    }
    Ok(total)
}
