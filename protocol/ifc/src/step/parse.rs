//! The text of a STEP file as instances.

use std::collections::BTreeMap;

use super::value::{Entity, Step, Value};

/// Lists within lists deeper than this are refused: nobody writes them, and each costs stack.
const MAX_DEPTH: usize = 32;

/// Why a file is no IFC file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IfcError {
    /// It does not begin as STEP files do.
    #[error("no STEP file: it does not begin with ISO-10303-21")]
    NotStep,
    /// A place where something else was expected.
    #[error("line {line}: expected {expected}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What is missing.
        expected: &'static str,
    },
    /// It holds no building.
    #[error("the file has no IfcBuildingStorey")]
    NoStorey,
    /// A storey that is not there.
    #[error("storey {asked} is not there: the file has {found}, counted from 0 at the lowest")]
    StoreyMissing {
        /// What was asked for.
        asked: usize,
        /// How many there are.
        found: usize,
    },
    /// Rooms come from spaces.
    #[error(
        "storey {storey} ({name}) has no IfcSpace with a body, so its rooms are not known: \
         choose another storey (`--storey`), or a file with rooms"
    )]
    NoSpaces {
        /// Counted from 0 at the lowest.
        storey: usize,
        /// Its name.
        name: String,
    },
}

struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// Parses a file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Step, IfcError> {
    let mut parser = Parser { bytes, at: 0 };
    parser.space();
    if !parser.skip(b"ISO-10303-21") {
        return Err(IfcError::NotStep);
    }
    let mut entities = BTreeMap::new();
    let mut schema = String::new();
    let mut in_data = false;
    loop {
        parser.space();
        if parser.peek().is_none() {
            break;
        }
        if parser.peek() == Some(b'#') {
            let (id, entity) = parser.instance()?;
            entities.insert(id, entity);
        } else if parser.skip(b"DATA") {
            in_data = true;
        } else if let (false, true) = (in_data, parser.skip(b"FILE_SCHEMA")) {
            parser.space();
            let names = parser.value(0)?;
            schema = first_text(&names).unwrap_or_default();
        } else {
            // Other parts of the header, ends of sections, separators.
            parser.at += 1;
            if parser.bytes[parser.at - 1] == b'\'' {
                parser.at -= 1;
                parser.quoted()?;
            }
        }
    }
    Ok(Step { schema, entities })
}

fn first_text(value: &Value) -> Option<String> {
    value.text().map(str::to_owned).or_else(|| value.list().iter().find_map(first_text))
}

impl Parser<'_> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn fail<T>(&self, expected: &'static str) -> Result<T, IfcError> {
        let before = &self.bytes[..self.at.min(self.bytes.len())];
        Err(IfcError::Syntax { line: 1 + before.iter().filter(|byte| **byte == b'\n').count(), expected })
    }

    fn skip(&mut self, word: &[u8]) -> bool {
        let found = self.bytes[self.at..].starts_with(word);
        self.at += if found { word.len() } else { 0 };
        found
    }

    /// White space and comments.
    fn space(&mut self) {
        loop {
            while self.peek().is_some_and(|byte| byte.is_ascii_whitespace()) {
                self.at += 1;
            }
            if !self.bytes[self.at..].starts_with(b"/*") {
                return;
            }
            let end = self.bytes[self.at + 2..].windows(2).position(|pair| pair == b"*/");
            self.at = end.map_or(self.bytes.len(), |end| self.at + 2 + end + 2);
        }
    }

    fn expect(&mut self, byte: u8, expected: &'static str) -> Result<(), IfcError> {
        self.space();
        if self.peek() != Some(byte) {
            return self.fail(expected);
        }
        self.at += 1;
        Ok(())
    }

    fn while_is(&mut self, is: impl Fn(u8) -> bool) -> String {
        let start = self.at;
        while self.peek().is_some_and(&is) {
            self.at += 1;
        }
        String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned()
    }

    fn id(&mut self) -> Result<u64, IfcError> {
        self.expect(b'#', "# and a number")?;
        let digits = self.while_is(|byte| byte.is_ascii_digit());
        digits.parse().or_else(|_| self.fail("a number of an instance"))
    }

    fn name(&mut self) -> String {
        self.while_is(|byte| byte.is_ascii_alphanumeric() || byte == b'_').to_ascii_uppercase()
    }

    fn instance(&mut self) -> Result<(u64, Entity), IfcError> {
        let id = self.id()?;
        self.expect(b'=', "=")?;
        self.space();
        let entity = if self.peek() == Some(b'(') {
            // Several types at once: only units of derived kinds are written so, which nobody asks for.
            self.value(0)?;
            Entity { kind: String::new(), attributes: Vec::new() }
        } else {
            let kind = self.name();
            let attributes = self.list(0)?;
            Entity { kind, attributes }
        };
        self.expect(b';', "; at the end of an instance")?;
        Ok((id, entity))
    }

    fn list(&mut self, depth: usize) -> Result<Vec<Value>, IfcError> {
        self.expect(b'(', "(")?;
        let mut values = Vec::new();
        loop {
            self.space();
            match self.peek() {
                Some(b')') => {
                    self.at += 1;
                    return Ok(values);
                }
                // Members are parted by commas; types of one instance by nothing.
                Some(b',') => self.at += 1,
                Some(_) => values.push(self.value(depth + 1)?),
                None => return self.fail(") at the end of a list"),
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value, IfcError> {
        if depth > MAX_DEPTH {
            return self.fail("fewer lists within lists");
        }
        self.space();
        match self.peek() {
            Some(b'$' | b'*') => {
                self.at += 1;
                Ok(Value::None)
            }
            Some(b'\'') => Ok(Value::Text(self.quoted()?)),
            Some(b'"') => {
                self.at += 1;
                let digits = self.while_is(|byte| byte != b'"');
                self.expect(b'"', "\" at the end of a binary")?;
                Ok(Value::Text(digits))
            }
            Some(b'.') => {
                self.at += 1;
                let word = self.while_is(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
                self.expect(b'.', ". at the end of a word")?;
                Ok(Value::Enum(word.to_ascii_uppercase()))
            }
            Some(b'#') => Ok(Value::Reference(self.id()?)),
            Some(b'(') => Ok(Value::List(self.list(depth)?)),
            Some(byte) if byte.is_ascii_digit() || byte == b'-' || byte == b'+' => self.number(),
            Some(byte) if byte.is_ascii_alphabetic() => {
                let name = self.name();
                Ok(Value::Typed(name, self.list(depth)?))
            }
            _ => self.fail("a value"),
        }
    }

    fn number(&mut self) -> Result<Value, IfcError> {
        let digits = self.while_is(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
        match digits.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Value::Number(value)),
            _ => self.fail("a number"),
        }
    }

    /// A text between apostrophes; an apostrophe in it is doubled.
    fn quoted(&mut self) -> Result<String, IfcError> {
        self.at += 1;
        let mut raw = Vec::new();
        loop {
            match (self.peek(), self.bytes.get(self.at + 1)) {
                (Some(b'\''), Some(b'\'')) => {
                    raw.push(b'\'');
                    self.at += 2;
                }
                (Some(b'\''), _) => {
                    self.at += 1;
                    return Ok(decoded(&String::from_utf8_lossy(&raw)));
                }
                (Some(byte), _) => {
                    raw.push(byte);
                    self.at += 1;
                }
                (None, _) => return self.fail("' at the end of a text"),
            }
        }
    }
}

/// Letters beyond ASCII: `\X2\00E4\X0\` and `\X\E4`.
fn decoded(raw: &str) -> String {
    let mut out = String::new();
    let mut rest = raw;
    while let Some(at) = rest.find('\\') {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        if let Some((digits, after)) = rest.strip_prefix("\\X2\\").and_then(|r| r.split_once("\\X0\\")) {
            let units = digits.as_bytes().chunks(4).map(|four| std::str::from_utf8(four).unwrap_or_default());
            let units: Vec<u16> = units.filter_map(|four| u16::from_str_radix(four, 16).ok()).collect();
            out.push_str(&String::from_utf16_lossy(&units));
            rest = after;
        } else if let Some(code) = rest.strip_prefix("\\X\\").and_then(|r| r.get(..2)) {
            out.push(u8::from_str_radix(code, 16).map_or('?', char::from));
            rest = &rest[5..];
        } else {
            out.push('\\');
            rest = &rest[1..];
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::{IfcError, Value, parse};

    const FILE: &str = "ISO-10303-21;\nHEADER;FILE_DESCRIPTION(('#1=X(;'),'2;1');\
        FILE_SCHEMA(('IFC4'));ENDSEC;\n\
        DATA;\n#1= IFCWALL('it''s',$,*,.TRUE.,(1,-2.5E-1,#7),\
        IFCLABEL('M\\X2\\00FC\\X0\\ller'));/* #9=A(); */\n\
        #2=(IFCNAMEDUNIT(*,.LENGTHUNIT.)IFCSIUNIT($));\nENDSEC;END-ISO-10303-21;";

    #[test]
    fn every_kind_of_value_is_read() {
        let step = parse(FILE.as_bytes()).expect("a file");
        assert_eq!(step.schema, "IFC4");
        let wall = step.get(1).expect("#1");
        assert_eq!((wall.kind.as_str(), wall.at(0).text()), ("IFCWALL", Some("it's")));
        assert_eq!((wall.at(1), wall.at(2), wall.at(99)), (&Value::None, &Value::None, &Value::None));
        assert!(wall.at(3).is("TRUE"));
        assert_eq!(wall.at(4).numbers(), vec![1.0, -0.25]);
        assert_eq!(wall.at(4).list()[2].reference(), Some(7));
        assert_eq!(wall.at(5).text(), Some("Müller"));
        assert_eq!(step.entities.len(), 2, "neither the header's text nor a comment is an instance");
    }

    #[test]
    fn every_truncation_is_an_error_or_a_shorter_file_and_never_a_panic() {
        for end in 0..FILE.len() {
            if let Some(part) = FILE.get(..end) {
                let _ = parse(part.as_bytes());
            }
        }
        assert_eq!(parse(b"PK\x03\x04"), Err(IfcError::NotStep));
        let deep = format!("ISO-10303-21;DATA;\n#1=A({}", "(".repeat(100_000));
        assert!(matches!(parse(deep.as_bytes()), Err(IfcError::Syntax { line: 2, .. })));
    }
}
