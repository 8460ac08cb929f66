//! The head of a PLY file: which elements follow, and which properties each of their rows has.

use super::PlyError;

/// A number's type in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// The number at the front of `bytes`, and how many bytes it takes.
    pub(super) fn read(self, bytes: &[u8]) -> Option<(f64, usize)> {
        Some(match self {
            Self::I8 => (f64::from(i8::from_le_bytes(*bytes.first_chunk()?)), 1),
            Self::U8 => (f64::from(u8::from_le_bytes(*bytes.first_chunk()?)), 1),
            Self::I16 => (f64::from(i16::from_le_bytes(*bytes.first_chunk()?)), 2),
            Self::U16 => (f64::from(u16::from_le_bytes(*bytes.first_chunk()?)), 2),
            Self::I32 => (f64::from(i32::from_le_bytes(*bytes.first_chunk()?)), 4),
            Self::U32 => (f64::from(u32::from_le_bytes(*bytes.first_chunk()?)), 4),
            Self::F32 => (f64::from(f32::from_le_bytes(*bytes.first_chunk()?)), 4),
            Self::F64 => (f64::from_le_bytes(*bytes.first_chunk()?), 8),
        })
    }
}

/// One number, or a count and that many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    One(Scalar),
    List(Scalar, Scalar),
}

/// A named column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

/// Rows of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

/// What follows the head.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub ascii: bool,
    pub elements: Vec<Element>,
}

/// A head longer than this is none.
const MAX_LINES: usize = 1000;

impl Header {
    /// Reads the head; the rest of the bytes are data.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), PlyError> {
        let mut rest = bytes;
        let mut header = Self { ascii: true, elements: Vec::new() };
        for line in 1..=MAX_LINES {
            let Some(end) = rest.iter().position(|byte| *byte == b'\n') else {
                return Err(PlyError::Header { line, expected: "a line", found: shortened(rest) });
            };
            let content = &rest[..end];
            rest = &rest[end + 1..];
            let text = String::from_utf8_lossy(content);
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            let wrong = |expected| PlyError::Header { line, expected, found: shortened(content) };
            match (line, words.as_slice()) {
                (1, ["ply"]) => {}
                (1, _) => return Err(wrong("ply")),
                (_, ["format", format, ..]) => header.set_format(format)?,
                (_, ["element", name, count]) => {
                    let count = count.parse().map_err(|_| wrong("a count"))?;
                    header.elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                (_, ["property", property @ ..]) => {
                    let property = parse_property(property).ok_or_else(|| wrong("a property"))?;
                    let element = header.elements.last_mut().ok_or_else(|| wrong("an element first"))?;
                    element.properties.push(property);
                }
                (_, ["end_header"]) => return Ok((header, rest)),
                (_, [] | ["comment" | "obj_info", ..]) => {}
                _ => return Err(wrong("format, element, property, comment or end_header")),
            }
        }
        Err(PlyError::Header { line: MAX_LINES, expected: "end_header", found: String::new() })
    }

    fn set_format(&mut self, format: &str) -> Result<(), PlyError> {
        self.ascii = match format {
            "ascii" => true,
            "binary_little_endian" => false,
            _ => return Err(PlyError::Format { found: format.to_owned() }),
        };
        Ok(())
    }
}

fn parse_property(words: &[&str]) -> Option<Property> {
    let (name, kind) = match words {
        ["list", count, scalar, name] => (name, Kind::List(Scalar::named(count)?, Scalar::named(scalar)?)),
        [scalar, name] => (name, Kind::One(Scalar::named(scalar)?)),
        _ => return None,
    };
    Some(Property { name: (*name).to_owned(), kind })
}

/// The first characters of what was found, for a message.
fn shortened(bytes: &[u8]) -> String {
    String::from_utf8_lossy(&bytes[..bytes.len().min(40)]).trim_end().to_owned()
}
