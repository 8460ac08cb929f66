//! STEP physical files (ISO 10303-21) and the identifiers of IFC.

use std::fmt::{self, Write as _};

use crate::formats::text::number::Number;

/// The number of an entity in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Id(u64);

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Several entities, as a list.
pub(crate) struct Ids<'a>(pub(crate) &'a [Id]);

impl fmt::Display for Ids<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(")?;
        for (place, id) in self.0.iter().enumerate() {
            write!(f, "{}{id}", if place > 0 { "," } else { "" })?;
        }
        f.write_str(")")
    }
}

/// A text: what is not ASCII as UTF-16 in hexadecimal digits.
pub(crate) struct Text<'a>(pub(crate) &'a str);

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_char('\'')?;
        for c in self.0.chars() {
            match c {
                '\'' | '\\' => write!(f, "{c}{c}")?,
                ' '..='~' => f.write_char(c)?,
                _ => {
                    f.write_str("\\X2\\")?;
                    c.encode_utf16(&mut [0; 2]).iter().try_for_each(|unit| write!(f, "{unit:04X}"))?;
                    f.write_str("\\X0\\")?;
                }
            }
        }
        f.write_char('\'')
    }
}

/// Numbers as a tuple.
pub(crate) struct Reals<'a>(pub(crate) &'a [f64]);

impl fmt::Display for Reals<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(")?;
        for (place, value) in self.0.iter().enumerate() {
            write!(f, "{}{}", if place > 0 { "," } else { "" }, Number(*value))?;
        }
        f.write_str(")")
    }
}

/// The data section in the making.
#[derive(Default)]
pub(crate) struct Step {
    text: String,
    entities: u64,
}

impl Step {
    /// Adds an entity, `IFCPOINT(...)` and the like.
    pub(crate) fn add(&mut self, entity: fmt::Arguments<'_>) -> Id {
        self.entities += 1;
        let id = Id(self.entities);
        let _ = writeln!(self.text, "{id}={entity};");
        id
    }

    /// All entities.
    pub(crate) fn into_text(self) -> String {
        self.text
    }
}

/// 64 digits of IFC's compressed identifiers.
const DIGITS: &[u8; 64] = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";

/// A GlobalId made of what it names: the same content has the same identifier in every file. FNV-1a over 128
/// bits, 22 digits of base 64.
pub(crate) fn global_id(content: fmt::Arguments<'_>) -> String {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let hash =
        content.to_string().bytes().fold(OFFSET, |hash, byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME));
    let digit = |place: u32| char::from(DIGITS[((hash >> (6 * place)) & 63) as usize]);
    (0..22).rev().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::{Reals, Step, Text, global_id};

    #[test]
    fn texts_numbers_and_entities_are_written_as_the_standard_wants() {
        assert_eq!(
            Text("it's a\\b \u{e9}\u{1d11e}").to_string(),
            "'it''s a\\\\b \\X2\\00E9\\X0\\\\X2\\D834DD1E\\X0\\'"
        );
        assert_eq!(Reals(&[-0.00001, 2.0]).to_string(), "(0.0000,2.0000)");
        let mut step = Step::default();
        let point = step.add(format_args!("IFCCARTESIANPOINT((0.,0.))"));
        step.add(format_args!("IFCAXIS2PLACEMENT2D({point},$)"));
        assert_eq!(step.into_text(), "#1=IFCCARTESIANPOINT((0.,0.));\n#2=IFCAXIS2PLACEMENT2D(#1,$);\n");
    }

    #[test]
    fn identifiers_follow_their_content() {
        // FNV-1a of no bytes is its offset: 0x6c62... begins with the bits 01 101100.
        let empty = global_id(format_args!(""));
        assert_eq!((empty.len(), &empty[..2]), (22, "1i"));
        assert_eq!(global_id(format_args!("wall {}", 1)), global_id(format_args!("wall 1")));
        assert_ne!(global_id(format_args!("wall 1")), global_id(format_args!("wall 2")));
    }
}
