//! Numbers as bytes, little-endian, with a checksum at the end; and back, without trust in any of them.

/// A checksum's length, bytes.
const SUM_BYTES: usize = 4;

/// Bytes that are being read.
pub(crate) struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    /// The bytes of a file that begins with `magic` and ends with their checksum; `None` for another file, or
    /// a damaged one.
    pub(crate) fn sealed(file: &'a [u8], magic: [u8; 8]) -> Option<Self> {
        let (content, sum) = file.split_last_chunk::<SUM_BYTES>()?;
        let rest = content.strip_prefix(&magic)?;
        (u32::from_le_bytes(*sum) == checksum(content)).then_some(Self { rest })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }

    /// One byte.
    pub(crate) fn byte(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    /// Two bytes.
    pub(crate) fn short(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    /// Four bytes.
    pub(crate) fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// Four bytes of a coordinate.
    pub(crate) fn single(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// Eight bytes of a number.
    pub(crate) fn double(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    /// A count of things of at least `bytes` each: no more than there are bytes for.
    pub(crate) fn count(&mut self, bytes: usize) -> Option<usize> {
        let count = usize::try_from(self.take().map(u64::from_le_bytes)?).ok()?;
        (count.checked_mul(bytes)? <= self.rest.len()).then_some(count)
    }

    /// Whether everything was read.
    pub(crate) fn is_done(&self) -> bool {
        self.rest.is_empty()
    }
}

/// CRC-32: enough against disks and copies that went wrong.
pub(crate) fn checksum(bytes: &[u8]) -> u32 {
    crc32fast::hash(bytes)
}

/// Adds the checksum of all that is there.
pub(crate) fn seal(bytes: &mut Vec<u8>) {
    let sum = checksum(bytes);
    bytes.extend(sum.to_le_bytes());
}

/// A count as it is read.
pub(crate) fn put_count(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend((count as u64).to_le_bytes());
}
