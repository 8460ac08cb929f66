//! The status byte that ends every reply (telegram listing, section 6).

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
        match self.0 & 0x07 {
            0 => Severity::Ok,
            1 => Severity::Info,
            2 => Severity::Warning,
            3 => Severity::Error,
            4 => Severity::Fatal,
            other => Severity::Unknown(other),
        }
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

impl Default for Status {
    fn default() -> Self {
        Status::OK
    }
}

#[cfg(test)]
mod tests {
    use super::{Severity, Status};

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
