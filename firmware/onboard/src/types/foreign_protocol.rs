//! Who speaks on a port where something else belongs, as a value and in words.

use std::fmt;

/// What speaks on a port where something else belongs.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum ForeignProtocol {
    /// Telegrams of an LMS 2xx.
    Laser,
    /// Packets of a Pioneer.
    Pioneer,
    /// Packets of an rFLEX base.
    Rflex,
    /// Measurements of an inertial unit.
    Inertial,
    /// NMEA 0183 sentences with their sum.
    Receiver,
    /// Lines of text.
    Text,
    /// What was sent, again.
    Echo,
}

impl fmt::Display for ForeignProtocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Laser => "a laser speaks on this port (are two plugs swapped?)",
            Self::Pioneer => "a Pioneer base speaks on this port (are two plugs swapped?)",
            Self::Rflex => "an rFLEX base speaks on this port (are two plugs swapped?)",
            Self::Inertial => "an inertial unit speaks on this port (are two plugs swapped?)",
            Self::Receiver => "a satellite receiver speaks on this port (NMEA): is it another device's?",
            Self::Text => {
                "something speaks text on this port, as a modem or a console does: is it another device's?"
            }
            Self::Echo => "this port sends back what it is sent: no device, or two wires joined",
        })
    }
}
