//! Records of a ROS 1 bag (format V2.0), one after the other: a header of named fields, then data.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};

/// A header larger than this is none: message definitions of tens of kilobytes stand in the data, not here.
const LONGEST_HEADER: u32 = 1 << 20;

/// Why the records end before the file does.
#[derive(Debug)]
pub(crate) enum Broken {
    /// The bytes end inside a record that begins at this byte.
    CutOff(u64),
    /// What stands at this byte is no record.
    Damaged(u64, &'static str),
    /// They cannot be read.
    Io(io::Error),
    /// Whoever takes the messages wants no more.
    Stopped,
}

/// A record's header, and how many bytes of data follow it.
#[derive(Debug)]
pub(crate) struct Record {
    /// Where it begins.
    pub offset: u64,
    header: Vec<u8>,
    /// Bytes of data.
    pub length: u32,
}

impl Record {
    /// The record's kind.
    pub(crate) fn op(&self) -> Option<u8> {
        match field(&self.header, "op") {
            Some([op]) => Some(*op),
            _ => None,
        }
    }

    /// A field of the header.
    pub(crate) fn field(&self, name: &str) -> Option<&[u8]> {
        field(&self.header, name)
    }

    /// A number of four bytes.
    pub(crate) fn u32(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(self.field(name)?.try_into().ok()?))
    }

    /// A number of eight bytes.
    pub(crate) fn u64(&self, name: &str) -> Option<u64> {
        Some(u64::from_le_bytes(self.field(name)?.try_into().ok()?))
    }
}

/// The value of a named field: `length name=value`, in any order. The value may hold any bytes.
pub(crate) fn field<'a>(mut header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    while let Some((length, rest)) = header.split_first_chunk::<4>() {
        let (field, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        header = rest;
        let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
        if value.is_some() {
            return value;
        }
    }
    None
}

/// Records of a stream, and where in it they begin.
pub(crate) struct Records<R> {
    input: R,
    offset: u64,
    start: u64,
}

impl<R: Read> Records<R> {
    /// Of a stream whose first byte has this place.
    pub(crate) fn new(input: R, offset: u64) -> Self {
        Self { input, offset, start: offset }
    }

    /// Bytes read so far.
    pub(crate) fn passed(&self) -> u64 {
        self.offset - self.start
    }

    /// The next record's header; `None` where the stream ends between two records.
    pub(crate) fn next(&mut self) -> Result<Option<Record>, Broken> {
        let offset = self.offset;
        let mut length = [0; 4];
        let first = loop {
            match self.input.read(&mut length[..1]) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                other => break other.map_err(|error| broken(error, offset))?,
            }
        };
        if first == 0 {
            return Ok(None);
        }
        self.offset += 1;
        self.fill(&mut length[1..], offset)?;
        let length = u32::from_le_bytes(length);
        if length > LONGEST_HEADER {
            return Err(Broken::Damaged(offset, "a header longer than any header"));
        }
        let header = self.take(length, offset)?;
        let mut length = [0; 4];
        self.fill(&mut length, offset)?;
        let record = Record { offset, header, length: u32::from_le_bytes(length) };
        match record.op() {
            Some(_) => Ok(Some(record)),
            None => Err(Broken::Damaged(offset, "no header of a record")),
        }
    }

    fn fill(&mut self, bytes: &mut [u8], record: u64) -> Result<(), Broken> {
        self.input.read_exact(bytes).map_err(|error| broken(error, record))?;
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// So many bytes; memory grows with those that are there.
    pub(crate) fn take(&mut self, length: u32, record: u64) -> Result<Vec<u8>, Broken> {
        let mut bytes = Vec::new();
        let limit = u64::from(length);
        self.input.by_ref().take(limit).read_to_end(&mut bytes).map_err(|error| broken(error, record))?;
        self.offset += bytes.len() as u64;
        if bytes.len() as u64 == limit { Ok(bytes) } else { Err(Broken::CutOff(record)) }
    }

    /// Passes over a record's data.
    pub(crate) fn skip(&mut self, record: &Record) -> Result<(), Broken> {
        let mut data = self.input.by_ref().take(u64::from(record.length));
        let passed = io::copy(&mut data, &mut io::sink()).map_err(|error| broken(error, record.offset))?;
        self.offset += passed;
        if passed == u64::from(record.length) { Ok(()) } else { Err(Broken::CutOff(record.offset)) }
    }
}

/// A file's reader as a record's data.
pub(crate) type Data<'a> = io::Take<&'a mut BufReader<File>>;

impl Records<BufReader<File>> {
    /// Hands a record's data on as a stream, and jumps over what is left of it: a file may claim gigabytes
    /// that are holes. The file has so many bytes.
    pub(crate) fn within<T>(
        &mut self,
        record: &Record,
        file_size: u64,
        read: impl FnOnce(&mut Data<'_>) -> T,
    ) -> Result<T, Broken> {
        let mut data = self.input.by_ref().take(u64::from(record.length));
        let found = read(&mut data);
        let left = data.limit();
        self.offset += u64::from(record.length);
        if self.offset > file_size {
            return Err(Broken::CutOff(record.offset));
        }
        // Four bytes of length: far within a signed number of eight.
        self.input.seek_relative(left as i64).map_err(|error| broken(error, record.offset))?;
        Ok(found)
    }
}

fn broken(error: io::Error, offset: u64) -> Broken {
    match error.kind() {
        ErrorKind::UnexpectedEof => Broken::CutOff(offset),
        _ => Broken::Io(error),
    }
}
