//! The header of a PLY file: format, elements, properties.

use crate::formats::ply::error::PlyError;
use std::borrow::Cow;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Words separated by white space.
    Ascii,
    /// Binary, least significant byte first.
    LittleEndian,
    /// Binary, most significant byte first.
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// A property of an element: a number, or a list of numbers with its length in front.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub name: String,
    pub value_type: Scalar,
    pub count_type: Option<Scalar>,
}

/// A kind of record and how many there are, as the header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

pub(crate) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
}

impl Header {
    /// The header and what follows it.
    pub(crate) fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), PlyError> {
        let mut lines = Lines { rest: bytes, line: 0 };
        if lines.next().is_none_or(|line| line.trim_end() != "ply") {
            return Err(PlyError::NotPly);
        }
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let Some(text) = lines.next() else {
                return Err(lines.error("end_header", "the end of the file"));
            };
            let words: Vec<&str> = text.split_whitespace().collect();
            match words.as_slice() {
                ["end_header"] => break,
                ["comment" | "obj_info", ..] | [] => {}
                ["format", "ascii", "1.0"] => format = Some(Format::Ascii),
                ["format", "binary_little_endian", "1.0"] => format = Some(Format::LittleEndian),
                ["format", "binary_big_endian", "1.0"] => format = Some(Format::BigEndian),
                ["format", ..] => return Err(lines.error(FORMATS, &text)),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| lines.error("a count", &text))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", kind @ ..] => {
                    let (Some(property), Some(element)) = (property(kind), elements.last_mut()) else {
                        return Err(lines.error(
                            "property TYPE NAME or property list TYPE TYPE NAME after an element",
                            &text,
                        ));
                    };
                    element.properties.push(property);
                }
                _ => return Err(lines.error("format, element, property, comment or end_header", &text)),
            }
        }
        let format = format.ok_or_else(|| lines.error("a format line before it", "end_header"))?;
        Ok((Self { format, elements }, lines.rest))
    }
}

fn property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", count, value, name] => Some(Property {
            name: (*name).to_owned(),
            value_type: scalar(value)?,
            count_type: Some(scalar(count)?),
        }),
        [value, name] => {
            Some(Property { name: (*name).to_owned(), value_type: scalar(value)?, count_type: None })
        }
        _ => None,
    }
}

fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

const FORMATS: &str = "format ascii, binary_little_endian or binary_big_endian, version 1.0";

/// Longest line of a header that is believed to be one.
const MAX_LINE: usize = 4096;
/// Characters of a line that an error shows.
const MAX_SHOWN: usize = 60;

struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Lines<'a> {
    /// The next line; what is no UTF-8 (comments of old programs) is replaced.
    fn next(&mut self) -> Option<Cow<'a, str>> {
        let end = self.rest.iter().take(MAX_LINE).position(|byte| *byte == b'\n')?;
        let (line, rest) = self.rest.split_at(end);
        self.rest = &rest[1..];
        self.line += 1;
        Some(String::from_utf8_lossy(line))
    }

    fn error(&self, expected: &'static str, found: &str) -> PlyError {
        // A header without an end runs on into binary numbers.
        let shown = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
        let found = found.trim().chars().take(MAX_SHOWN).map(shown).collect();
        PlyError::Header { line: self.line, expected, found }
    }
}
