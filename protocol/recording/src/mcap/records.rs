//! MCAP records as views of bytes (mcap.dev/spec): an opcode byte, a length of 8 bytes, a body; all numbers
//! little endian.
//!
//! Written apart from the `mcap` crate, whose writer we use: a file that broke must be walked byte by byte,
//! with offsets, and no length in it may be believed before the bytes are there.

use std::collections::BTreeMap;

/// First and last bytes of every MCAP file.
pub(crate) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// Bytes before a record's body: opcode and length.
pub(crate) const PREFIX_SIZE: u64 = 9;

pub(crate) const HEADER: u8 = 0x01;
pub(crate) const FOOTER: u8 = 0x02;
pub(crate) const SCHEMA: u8 = 0x03;
pub(crate) const CHANNEL: u8 = 0x04;
pub(crate) const MESSAGE: u8 = 0x05;
pub(crate) const CHUNK: u8 = 0x06;
pub(crate) const MESSAGE_INDEX: u8 = 0x07;
pub(crate) const ATTACHMENT: u8 = 0x09;
pub(crate) const METADATA: u8 = 0x0C;
pub(crate) const DATA_END: u8 = 0x0F;

/// A record's opcode and body length.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Prefix {
    pub opcode: u8,
    pub length: u64,
}

impl Prefix {
    pub(crate) fn parse(bytes: [u8; PREFIX_SIZE as usize]) -> Self {
        let [opcode, length @ ..] = bytes;
        Self { opcode, length: u64::from_le_bytes(length) }
    }
}

/// Takes fields off the front of a record's body; `None` when the body ends too early or a field is not what
/// it should be.
pub(crate) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    /// Bytes counted by a `u32`.
    pub(crate) fn counted(&mut self) -> Option<&'a [u8]> {
        let count = usize::try_from(self.u32()?).ok()?;
        self.take(count)
    }

    pub(crate) fn string(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.counted()?).ok()
    }

    pub(crate) fn string_map(&mut self) -> Option<BTreeMap<String, String>> {
        let mut inside = Fields(self.counted()?);
        let mut map = BTreeMap::new();
        while !inside.0.is_empty() {
            map.insert(inside.string()?.to_owned(), inside.string()?.to_owned());
        }
        Some(map)
    }
}

/// The body of a header record.
pub(crate) struct Header<'a> {
    pub profile: &'a str,
    pub library: &'a str,
}

impl<'a> Header<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Self { profile: fields.string()?, library: fields.string()? })
    }
}

/// The body of a schema record.
pub(crate) struct Schema<'a> {
    pub id: u16,
    pub name: &'a str,
    pub encoding: &'a str,
    pub data: &'a [u8],
}

impl<'a> Schema<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let (id, name, encoding) = (fields.u16()?, fields.string()?, fields.string()?);
        Some(Self { id, name, encoding, data: fields.counted()? })
    }
}

/// The body of a channel record.
pub(crate) struct Channel<'a> {
    pub id: u16,
    pub schema_id: u16,
    pub topic: &'a str,
    pub message_encoding: &'a str,
    pub metadata: BTreeMap<String, String>,
}

impl<'a> Channel<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Self {
            id: fields.u16()?,
            schema_id: fields.u16()?,
            topic: fields.string()?,
            message_encoding: fields.string()?,
            metadata: fields.string_map()?,
        })
    }
}

/// The body of a message record.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Message<'a> {
    pub channel_id: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: &'a [u8],
}

impl<'a> Message<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Self {
            channel_id: fields.u16()?,
            sequence: fields.u32()?,
            log_time: fields.u64()?,
            publish_time: fields.u64()?,
            data: fields.0,
        })
    }
}

/// The front of a chunk record's body, before its compressed bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct ChunkHeader {
    pub start_time: u64,
    pub end_time: u64,
    pub uncompressed_size: u64,
    /// Of the uncompressed bytes; 0 = not given.
    pub crc: u32,
    pub compression: String,
    pub compressed_size: u64,
}

impl ChunkHeader {
    /// Parses the header and gives how many bytes it took.
    pub(crate) fn parse(body: &[u8]) -> Option<(Self, usize)> {
        let mut fields = Fields(body);
        let header = Self {
            start_time: fields.u64()?,
            end_time: fields.u64()?,
            uncompressed_size: fields.u64()?,
            crc: fields.u32()?,
            compression: fields.string()?.to_owned(),
            compressed_size: fields.u64()?,
        };
        Some((header, body.len() - fields.0.len()))
    }
}

/// A file in a recording.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Attachment<'a> {
    /// When it was added, in ns.
    pub log_time_ns: u64,
    /// When it was made, in ns.
    pub create_time_ns: u64,
    /// Its name, for example `rig.toml`.
    pub name: &'a str,
    /// What its bytes are, for example `application/toml`.
    pub media_type: &'a str,
    /// Its bytes.
    pub data: &'a [u8],
    /// False when a checksum is given and is another.
    pub intact: bool,
}

impl<'a> Attachment<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let (log_time_ns, create_time_ns) = (fields.u64()?, fields.u64()?);
        let (name, media_type) = (fields.string()?, fields.string()?);
        let length = usize::try_from(fields.u64()?).ok()?;
        let data = fields.take(length)?;
        let summed = body.get(..body.len() - fields.0.len())?;
        let crc = fields.u32()?;
        let intact = crc == 0 || crc32fast::hash(summed) == crc;
        Some(Self { log_time_ns, create_time_ns, name, media_type, data, intact })
    }

    /// How long a body is by its own word, from its first bytes; `None` when these are no attachment's.
    pub(crate) fn parse_length(front: &'a [u8]) -> Option<u64> {
        let mut fields = Fields(front);
        fields.take(16)?;
        fields.string()?;
        fields.string()?;
        let data = fields.u64()?;
        let before = (front.len() - fields.0.len()) as u64;
        before.checked_add(data)?.checked_add(4)
    }

    /// The name alone, from the first bytes of a body.
    pub(crate) fn parse_name(body: &'a [u8]) -> Option<&'a str> {
        let mut fields = Fields(body);
        fields.take(16)?;
        fields.string()
    }
}

/// The body of a metadata record.
pub(crate) struct Metadata<'a> {
    pub name: &'a str,
    pub values: BTreeMap<String, String>,
}

impl<'a> Metadata<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Self { name: fields.string()?, values: fields.string_map()? })
    }
}

/// The records inside a chunk, or inside a piece of one: each opcode with its body, and where it begins. Ends
/// at the first record that is not whole; [`Inner::rest`] is then what is left.
pub(crate) struct Inner<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Inner<'a> {
    /// Continues at a position that an earlier walk stopped at.
    pub(crate) fn at(bytes: &'a [u8], position: usize) -> Self {
        Self { bytes, position }
    }

    pub(crate) fn position(&self) -> usize {
        self.position
    }

    pub(crate) fn rest(&self) -> usize {
        self.bytes.len().saturating_sub(self.position)
    }
}

impl<'a> Iterator for Inner<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let mut fields = Fields(self.bytes.get(self.position..)?);
        let prefix = Prefix::parse(fields.take(PREFIX_SIZE as usize)?.try_into().ok()?);
        let body = fields.take(usize::try_from(prefix.length).ok()?)?;
        self.position = self.bytes.len() - fields.0.len();
        Some((prefix.opcode, body))
    }
}
