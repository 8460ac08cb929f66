//! The items of a measurement: identifier, length and bytes of each.

use super::emit::data_offset;
use crate::WireError;
use crate::cursor::{Reader, Writer};

/// Most bytes of items that are written at once: those of a message with a plain length.
pub const MAX_ITEMS_BYTES: usize = 254;

/// One item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item<'a> {
    /// What it says, and how.
    pub identifier: u16,
    /// Its bytes.
    pub bytes: &'a [u8],
    /// Where they stand in the message.
    pub offset: usize,
}

/// A row of items, each whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Items<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> Items<'a> {
    /// Items that begin at `offset` of their message.
    ///
    /// # Errors
    /// The last item is cut.
    pub(super) fn new(bytes: &'a [u8], offset: usize) -> Result<Self, WireError> {
        let mut reader = Reader::new(bytes, offset);
        while reader.remaining() > 0 {
            item(&mut reader)?;
        }
        Ok(Self { bytes, offset })
    }

    /// Items as written by [`ItemsWriter`].
    ///
    /// # Errors
    /// The last item is cut.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        Self::new(bytes, data_offset(bytes.len()))
    }

    /// All bytes.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// One item after the other.
    pub fn iter(&self) -> impl Iterator<Item = Item<'a>> + use<'a> {
        let mut reader = Reader::new(self.bytes, self.offset);
        core::iter::from_fn(move || item(&mut reader).ok())
    }
}

fn item<'a>(reader: &mut Reader<'a>) -> Result<Item<'a>, WireError> {
    let identifier = reader.be_u16()?;
    let length = usize::from(reader.u8()?);
    let offset = reader.offset();
    Ok(Item { identifier, bytes: reader.take(length)?, offset })
}

/// Writes a row of items.
#[derive(Clone, Debug, Default)]
pub struct ItemsWriter {
    bytes: heapless::Vec<u8, MAX_ITEMS_BYTES>,
}

impl ItemsWriter {
    /// The items written so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(super) fn push(&mut self, identifier: u16, write: impl Fn(&mut Writer<'_>)) -> Result<(), WireError> {
        let length = Writer::measure(&write);
        let from = self.bytes.len();
        let (needed, found) = (from + 3 + length, MAX_ITEMS_BYTES);
        let full = || WireError::BufferTooSmall { needed, found };
        let stated = u8::try_from(length).map_err(|_| full())?;
        self.bytes.resize(needed, 0).map_err(|_| full())?;
        let mut writer = Writer::new(self.bytes.get_mut(from..).unwrap_or_default());
        writer.bytes(&identifier.to_be_bytes());
        writer.u8(stated);
        write(&mut writer);
        writer.finish().map(|_| ())
    }
}
