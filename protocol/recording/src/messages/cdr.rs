//! CDR, the bytes of ROS 2 messages: little endian, a header `00 01 00 00`, every number aligned to its own
//! size counted from after that header (OMG DDS-RTPS 2.3 section 10, CDR version 1).
//!
//! ROS 1 has the same fields in the same order, packed: [`Decoder::ros1`].
//!
//! A string is its length with the closing NUL as `u32`, its bytes, the NUL. A sequence is its count as `u32`
//! and its elements; a fixed array is its elements alone. The decoder trusts no length: one that promises
//! more than the bytes that are left is an error before anything is allocated.

const HEADER: [u8; 4] = [0, 1, 0, 0];
const NS_PER_S: i64 = 1_000_000_000;

/// Why bytes are not the message that they should be. Offsets count from the first byte of the header.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum CdrError {
    /// The first two bytes name another encoding.
    #[error("CDR header at byte 0: expected 00 01 (plain CDR, little endian), found {found:02x?}")]
    Header {
        /// The first bytes that were there, at most four.
        found: Vec<u8>,
    },
    /// The bytes end inside a field.
    #[error("message ends early: {needed} bytes needed at byte {offset}, {left} left")]
    Short {
        /// Where the field begins.
        offset: usize,
        /// How many bytes it needs, at least.
        needed: usize,
        /// How many there are.
        left: usize,
    },
    /// A string is not UTF-8, or does not close with NUL.
    #[error("string at byte {offset} is not text: {what}")]
    Text {
        /// Where the string's bytes begin.
        offset: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Bytes follow the last field.
    #[error("{count} bytes too many from byte {offset}")]
    Trailing {
        /// Where the message should have ended.
        offset: usize,
        /// How many bytes follow.
        count: usize,
    },
}

/// Writes one message's bytes.
#[derive(Debug)]
pub struct Encoder<'a> {
    out: &'a mut Vec<u8>,
}

impl<'a> Encoder<'a> {
    /// Starts a message in `out`, whose content is replaced and whose memory is kept.
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        out.clear();
        out.extend_from_slice(&HEADER);
        Self { out }
    }

    fn align(&mut self, size: usize) {
        // The header is four bytes long, so alignment counts from there.
        let position = self.out.len() - HEADER.len();
        self.out.resize(HEADER.len() + position.next_multiple_of(size), 0);
    }

    /// Writes one byte.
    pub fn u8(&mut self, value: u8) {
        self.out.push(value);
    }

    /// Writes an unsigned number of 32 bits.
    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes a signed number of 32 bits.
    pub fn i32(&mut self, value: i32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes a number of 32 bits.
    pub fn f32(&mut self, value: f32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes numbers of 64 bits, without a count: fixed arrays and the like.
    pub fn f64_array(&mut self, values: &[f64]) {
        self.align(8);
        for value in values {
            self.out.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// Writes the number of elements that follow, capped at what the field holds (no message of ours comes
    /// near).
    pub fn count(&mut self, count: usize) {
        self.u32(u32::try_from(count).unwrap_or(u32::MAX));
    }

    /// Writes a counted sequence of 32-bit numbers.
    pub fn f32_sequence(&mut self, values: &[f32]) {
        self.count(values.len());
        for value in values {
            self.out.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// Writes a counted sequence of bytes.
    pub fn byte_sequence(&mut self, bytes: &[u8]) {
        self.count(bytes.len());
        self.out.extend_from_slice(bytes);
    }

    /// Writes a string.
    pub fn string(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
    }

    /// Writes a time as seconds and nanoseconds. Times outside what 32-bit seconds hold (1901 to 2038) become
    /// the nearest that fits.
    pub fn stamp_ns(&mut self, stamp_ns: i64) {
        let seconds = stamp_ns.div_euclid(NS_PER_S);
        let clamped = seconds.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let nanoseconds = match seconds.cmp(&clamped) {
            std::cmp::Ordering::Less => 0,
            std::cmp::Ordering::Equal => stamp_ns.rem_euclid(NS_PER_S),
            std::cmp::Ordering::Greater => NS_PER_S - 1,
        };
        self.i32(clamped as i32);
        self.u32(nanoseconds as u32);
    }

    /// Writes a `std_msgs/msg/Header`.
    pub fn header(&mut self, stamp_ns: i64, frame_id: &str) {
        self.stamp_ns(stamp_ns);
        self.string(frame_id);
    }
}

/// How a message's numbers and texts lie.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Layout {
    /// ROS 2: numbers aligned, texts with a closing NUL.
    Cdr,
    /// ROS 1: nothing aligned, texts without NUL, a header begins with its sequence number.
    Ros1,
}

/// Reads one message's bytes.
#[derive(Debug)]
pub struct Decoder<'a> {
    bytes: &'a [u8],
    position: usize,
    layout: Layout,
}

impl<'a> Decoder<'a> {
    /// Starts at a message's header.
    ///
    /// # Errors
    /// [`CdrError::Header`] when the bytes are not plain CDR in little endian.
    pub fn new(bytes: &'a [u8]) -> Result<Self, CdrError> {
        // The last two header bytes are options that readers ignore.
        match bytes {
            [0, 1, _, _, ..] => Ok(Self { bytes, position: HEADER.len(), layout: Layout::Cdr }),
            _ => Err(CdrError::Header { found: bytes.iter().copied().take(4).collect() }),
        }
    }

    /// Starts at the first byte of a ROS 1 message: the same fields in the same order, packed, and without a
    /// header of the encoding.
    #[must_use]
    pub fn ros1(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0, layout: Layout::Ros1 }
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.position
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        let rest = self.bytes.get(self.position..).unwrap_or_default();
        match rest.get(..count) {
            Some(taken) => {
                self.position += count;
                Ok(taken)
            }
            None => Err(CdrError::Short { offset: self.position, needed: count, left: rest.len() }),
        }
    }

    fn align(&mut self, size: usize) -> Result<(), CdrError> {
        if self.layout == Layout::Ros1 {
            return Ok(());
        }
        let position = self.position - HEADER.len();
        self.take(position.next_multiple_of(size) - position).map(|_padding| ())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// Reads one byte.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn u8(&mut self) -> Result<u8, CdrError> {
        self.array().map(u8::from_le_bytes)
    }

    /// Reads an unsigned number of 32 bits.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn u32(&mut self) -> Result<u32, CdrError> {
        self.align(4)?;
        self.array().map(u32::from_le_bytes)
    }

    /// Reads a signed number of 32 bits.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn i32(&mut self) -> Result<i32, CdrError> {
        self.align(4)?;
        self.array().map(i32::from_le_bytes)
    }

    /// Reads a number of 32 bits.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn f32(&mut self) -> Result<f32, CdrError> {
        self.align(4)?;
        self.array().map(f32::from_le_bytes)
    }

    /// Reads an array of fixed size.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn f64_array<const N: usize>(&mut self) -> Result<[f64; N], CdrError> {
        self.align(8)?;
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f64::from_le_bytes(self.array()?);
        }
        Ok(values)
    }

    /// Reads a sequence's count, whose elements take `element_size` bytes each at least.
    ///
    /// # Errors
    /// [`CdrError::Short`] when so many elements cannot follow.
    pub fn count(&mut self, element_size: usize) -> Result<usize, CdrError> {
        let count = self.u32()? as usize;
        let needed = count.saturating_mul(element_size);
        if needed > self.left() {
            return Err(CdrError::Short { offset: self.position, needed, left: self.left() });
        }
        Ok(count)
    }

    /// Reads a counted sequence of 32-bit numbers.
    ///
    /// # Errors
    /// [`CdrError::Short`] when the count promises more than is left.
    pub fn f32_sequence(&mut self) -> Result<Vec<f32>, CdrError> {
        let count = self.count(4)?;
        let bytes = self.take(count * 4)?;
        let number = |chunk: &[u8]| chunk.try_into().map_or(f32::NAN, f32::from_le_bytes);
        Ok(bytes.chunks_exact(4).map(number).collect())
    }

    /// Reads a counted sequence of bytes.
    ///
    /// # Errors
    /// [`CdrError::Short`] when the count promises more than is left.
    pub fn byte_sequence(&mut self) -> Result<&'a [u8], CdrError> {
        let count = self.count(1)?;
        self.take(count)
    }

    /// Reads a string. An empty one may lack its NUL, as some writers do.
    ///
    /// # Errors
    /// [`CdrError::Short`] when its length promises more than is left, [`CdrError::Text`] when it is not a
    /// string.
    pub fn string(&mut self) -> Result<String, CdrError> {
        let bytes = self.byte_sequence()?;
        let offset = self.position - bytes.len();
        let text = match (self.layout, bytes) {
            (Layout::Ros1, text) => text,
            (Layout::Cdr, []) => &[],
            (Layout::Cdr, [text @ .., 0]) => text,
            (Layout::Cdr, _) => return Err(CdrError::Text { offset, what: "no NUL at its end" }),
        };
        match std::str::from_utf8(text) {
            Ok(text) => Ok(text.to_owned()),
            Err(_) => Err(CdrError::Text { offset, what: "not UTF-8" }),
        }
    }

    /// Reads a time, in nanoseconds.
    ///
    /// # Errors
    /// [`CdrError::Short`] at the end.
    pub fn stamp_ns(&mut self) -> Result<i64, CdrError> {
        let seconds = self.i32()?;
        let nanoseconds = self.u32()?;
        // Within i64 for every pair of fields.
        Ok(i64::from(seconds) * NS_PER_S + i64::from(nanoseconds))
    }

    /// Reads a `std_msgs/msg/Header`: stamp in nanoseconds, and frame.
    ///
    /// # Errors
    /// As [`Decoder::stamp_ns`] and [`Decoder::string`].
    pub fn header(&mut self) -> Result<(i64, String), CdrError> {
        if self.layout == Layout::Ros1 {
            self.u32()?;
        }
        Ok((self.stamp_ns()?, self.string()?))
    }

    /// Ends the message. Up to three bytes of padding may follow: some middleware fills messages up to four
    /// bytes.
    ///
    /// # Errors
    /// [`CdrError::Trailing`] when more follows.
    pub fn finish(self) -> Result<(), CdrError> {
        match self.left() {
            0..=3 => Ok(()),
            count => Err(CdrError::Trailing { offset: self.position, count }),
        }
    }
}
