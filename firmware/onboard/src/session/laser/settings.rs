//! What a laser shall be set to, and what it says of itself.

use crate::session::ShortText;
use biplane_recording::rig;
use biplane_wire::lms::{Config, MeasuringMode, Unit};

/// What the rig asks of a laser.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct LaserSettings {
    /// Rate to run at, bits per second.
    pub baud: u32,
    /// Field of view, degrees.
    pub fov_deg: u16,
    /// Step from beam to beam, hundredths of a degree.
    pub resolution_cdeg: u16,
    /// Unit of the measured values.
    pub unit: Unit,
}

impl From<&rig::Laser> for LaserSettings {
    fn from(laser: &rig::Laser) -> Self {
        Self {
            baud: laser.baud,
            fov_deg: laser.fov_deg,
            resolution_cdeg: (laser.resolution_deg * 100.0).round() as u16,
            unit: match laser.units {
                rig::Units::Cm => Unit::Cm,
                rig::Units::Mm => Unit::Mm,
            },
        }
    }
}

/// What is known of a laser; fields are `None` until it has told.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LaserInfo {
    /// Rate at which it answered, bits per second.
    pub found_baud: Option<u32>,
    /// Type text, for example `LMS291;S05;X01.27`.
    pub type_text: ShortText,
    /// Firmware version of the status reply.
    pub firmware: ShortText,
    /// Whether the status reply's fault flag is set.
    pub has_fault: Option<bool>,
    /// Field of view in force, degrees, and step, hundredths of a degree.
    pub variant: Option<(u16, u16)>,
    /// Its configuration.
    pub config: Option<Config>,
}

impl LaserInfo {
    /// How its values are to be read: as configured, or 13 bits when the configuration is not known.
    #[must_use]
    pub fn measuring_mode(&self) -> MeasuringMode {
        self.config.as_ref().and_then(Config::measuring_mode).unwrap_or_default()
    }

    /// An S14 measures its 181 beams in one turn, 90 degrees wide; others with 181 beams are 180 degrees wide.
    #[must_use]
    pub fn is_s14(&self) -> bool {
        self.type_text.contains(";S14")
    }
}
