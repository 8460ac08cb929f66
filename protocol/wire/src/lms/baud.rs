//! The four rates of the line (telegram listing, command 20h, sub-commands 40h to 48h).

/// A rate that an LMS can talk at. Power-on is at 9600 unless made permanent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Baud {
    /// 9600 bit/s, the rate after power-on.
    #[default]
    B9600,
    /// 19 200 bit/s.
    B19200,
    /// 38 400 bit/s.
    B38400,
    /// 500 000 bit/s, on RS-422 only.
    B500000,
}

impl Baud {
    /// All rates, slowest first.
    pub const ALL: [Baud; 4] = [Baud::B9600, Baud::B19200, Baud::B38400, Baud::B500000];

    /// Bits per second; a byte takes ten bit times.
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Baud::B9600 => 9_600,
            Baud::B19200 => 19_200,
            Baud::B38400 => 38_400,
            Baud::B500000 => 500_000,
        }
    }

    /// The rate of that many bits per second, if an LMS has it.
    pub fn from_bits_per_second(bits_per_second: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|baud| baud.bits_per_second() == bits_per_second)
    }

    /// Sub-command of 20h that switches to this rate.
    pub(crate) const fn sub_command(self) -> u8 {
        match self {
            Baud::B9600 => 0x42,
            Baud::B19200 => 0x41,
            Baud::B38400 => 0x40,
            Baud::B500000 => 0x48,
        }
    }

    pub(crate) fn from_sub_command(sub_command: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|baud| baud.sub_command() == sub_command)
    }

    /// The rate's code in the status reply.
    pub const fn status_code(self) -> u16 {
        match self {
            Baud::B9600 => 0x8067,
            Baud::B19200 => 0x8033,
            Baud::B38400 => 0x8019,
            Baud::B500000 => 0x8001,
        }
    }

    /// The rate with that code in the status reply.
    pub fn from_status_code(code: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|baud| baud.status_code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::Baud;

    #[test]
    fn every_rate_survives_its_three_codes() {
        for baud in Baud::ALL {
            assert_eq!(Baud::from_bits_per_second(baud.bits_per_second()), Some(baud));
            assert_eq!(Baud::from_status_code(baud.status_code()), Some(baud));
            assert_eq!(Baud::from_sub_command(baud.sub_command()), Some(baud));
        }
        assert_eq!(Baud::from_bits_per_second(57_600), None);
    }
}
