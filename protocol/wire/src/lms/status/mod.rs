//! The status byte that ends every reply (telegram listing, section 6).

pub(crate) mod faults;
pub(crate) mod report;

use core::fmt;

/// How bad the worst current fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// No fault.
    Ok,
    /// Something to know.
    Info,
    /// Still measures.
    Warning,
    /// May not measure.
    Error,
    /// Does not measure.
    Fatal,
    /// A code that the listing does not name.
    Unknown(u8),
}

impl Severity {
    /// The severity of a code in status bytes and fault lists.
    pub const fn from_code(code: u8) -> Self {
        match code {
            0 => Severity::Ok,
            1 => Severity::Info,
            2 => Severity::Warning,
            3 => Severity::Error,
            4 => Severity::Fatal,
            other => Severity::Unknown(other),
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Severity::Ok => f.write_str("ok"),
            Severity::Info => f.write_str("info"),
            Severity::Warning => f.write_str("warning"),
            Severity::Error => f.write_str("error"),
            Severity::Fatal => f.write_str("fatal error"),
            Severity::Unknown(code) => write!(f, "type {code}"),
        }
    }
}

/// The status byte of a reply. Usually 10h; a healthy LMS 200 was also seen to send 11h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Status(
    /// The byte as sent.
    pub u8,
);

impl Status {
    /// Healthy, LMS type 6: what almost every reply carries.
    pub const OK: Status = Status(0x10);

    /// Bits 0 to 2.
    pub fn severity(self) -> Severity {
        Severity::from_code(self.0 & 0x07)
    }

    /// Bits 3 and 4: 2 = LMS type 6, 3 = special device.
    pub fn source(self) -> u8 {
        self.0 >> 3 & 0x03
    }

    /// Bit 5: level of the restart input.
    pub fn restart_input(self) -> bool {
        self.0 & 0x20 != 0
    }

    /// Bit 6: measured values are implausible.
    pub fn implausible(self) -> bool {
        self.0 & 0x40 != 0
    }

    /// Bit 7: the front window is polluted.
    pub fn polluted(self) -> bool {
        self.0 & 0x80 != 0
    }
}

/// In words, what differs from a healthy LMS; the restart input is no fault and is left out.
impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.severity())?;
        if self.polluted() {
            f.write_str(", front window polluted")?;
        }
        if self.implausible() {
            f.write_str(", measured values implausible")?;
        }
        match self.source() {
            2 => Ok(()),
            3 => f.write_str(", special device"),
            other => write!(f, ", source {other}"),
        }
    }
}

impl Default for Status {
    fn default() -> Self {
        Status::OK
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Severity, Status};
    use std::string::ToString;

    #[test]
    fn a_status_is_said_in_words() {
        assert_eq!(Status(0x10).to_string(), "ok");
        assert_eq!(Status(0x92).to_string(), "warning, front window polluted");
        assert_eq!(
            Status(0xD4).to_string(),
            "fatal error, front window polluted, measured values implausible"
        );
        assert_eq!(Status(0x1D).to_string(), "type 5, special device");
        assert_eq!(Status(0x03).to_string(), "error, source 0");
    }

    #[test]
    fn bits_are_where_the_listing_puts_them() {
        assert_eq!(Status::OK.severity(), Severity::Ok);
        assert_eq!(Status::OK.source(), 2);
        assert_eq!(Status(0x11).severity(), Severity::Info);
        assert_eq!(Status(0x1C).severity(), Severity::Fatal);
        assert_eq!(Status(0x18).source(), 3);
        assert!(Status(0x90).polluted() && Status(0x50).implausible() && Status(0x30).restart_input());
        assert!(!Status::OK.polluted() && !Status::OK.implausible() && !Status::OK.restart_input());
    }
}
