//! The list of faults: reply B2h (telegram listing, section 7.10).
//!
//! Pairs of a type and a number. The type says how bad it is, and whether it is over; what a number means is
//! not in the listing, so it stays a number.

use core::fmt;

use crate::WireError;
use crate::lms::frame::DATA_OFFSET;
use crate::lms::status::Severity;

/// Set in the type of a fault that is over.
const NO_LONGER_CURRENT: u8 = 0x80;

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fault {
    /// How bad it is.
    pub severity: Severity,
    /// Whether it is there now; the device keeps faults that are over until it is reset.
    pub is_current: bool,
    /// Its number; the listing does not say what it means.
    pub number: u8,
}

impl From<[u8; 2]> for Fault {
    fn from([kind, number]: [u8; 2]) -> Self {
        Self {
            severity: Severity::from_code(kind & !NO_LONGER_CURRENT),
            is_current: kind & NO_LONGER_CURRENT == 0,
            number,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let over = if self.is_current { "" } else { " (over)" };
        write!(f, "{} {}{over}", self.severity, self.number)
    }
}

/// Faults in place, pairs of type and number; empty when there are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorList<'a> {
    pairs: &'a [[u8; 2]],
}

impl<'a> ErrorList<'a> {
    /// The list of these `[type, number]` pairs.
    pub fn new(pairs: &'a [[u8; 2]]) -> Self {
        Self { pairs }
    }

    /// `[type, number]` of every fault. Type: 0 ok, 1 info, 2 warning, 3 error, 4 fatal; + 80h = no longer
    /// current.
    pub fn pairs(&self) -> &'a [[u8; 2]] {
        self.pairs
    }

    /// The faults in the device's order.
    pub fn faults(&self) -> impl ExactSizeIterator<Item = Fault> + Clone + use<'a> {
        self.pairs.iter().map(|&pair| Fault::from(pair))
    }

    pub(crate) fn parse(data: &'a [u8]) -> Result<Self, WireError> {
        match data.as_chunks::<2>() {
            (pairs, []) => Ok(Self { pairs }),
            _ => {
                let found = DATA_OFFSET + data.len();
                Err(WireError::TooShort { needed: found + 1, found })
            }
        }
    }
}

impl fmt::Display for ErrorList<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.pairs.is_empty() {
            return f.write_str("no faults");
        }
        for (index, fault) in self.faults().enumerate() {
            let gap = if index == 0 { "" } else { ", " };
            write!(f, "{gap}{fault}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::ErrorList;
    use std::string::ToString;

    #[test]
    fn faults_are_said_by_severity_and_number_and_whether_they_are_over() {
        let list = ErrorList::new(&[[3, 12], [0x82, 7], [0x84, 1], [9, 2]]);
        assert_eq!(list.to_string(), "error 12, warning 7 (over), fatal error 1 (over), type 9 2");
        assert_eq!(ErrorList::new(&[]).to_string(), "no faults");
    }
}
