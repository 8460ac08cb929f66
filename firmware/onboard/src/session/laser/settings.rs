//! What a laser shall be set to, and what it says of itself.

use super::health::FaultList;
use super::wanted::ConfigChange;
use crate::session::ShortText;
use biplane_recording::rig;
use biplane_wire::lms::{Config, MeasuringMode, STATUS_REPORT_BYTES, Status, StatusReport, Unit};

/// What the rig asks of a laser.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct LaserSettings {
    /// Rate to run at, bits per second.
    pub baud: u32,
    /// Field of view, degrees; 90 is an S14.
    pub fov_deg: u16,
    /// Step from beam to beam, hundredths of a degree.
    pub resolution_cdeg: u16,
    /// Unit of the measured values.
    pub unit: Unit,
    /// How far it shall measure, metres; `None`: as it is set.
    pub range_max_m: Option<u16>,
    /// Whether telegrams carry index bytes; `None`: as it is set.
    pub index_bytes: Option<bool>,
    /// Whether remission is asked for.
    pub remission: bool,
    /// Whether it goes on measuring when dazzled; `None`: as it is set.
    pub dazzle_tolerant: Option<bool>,
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
            range_max_m: laser.range_max_m,
            index_bytes: laser.index_bytes,
            remission: laser.remission,
            dazzle_tolerant: laser.dazzle_tolerant,
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
    /// Status byte of its last reply.
    pub status: Option<Status>,
    /// Field of view in force, degrees, and step, hundredths of a degree.
    pub variant: Option<(u16, u16)>,
    /// Its configuration.
    pub config: Option<Config>,
    /// Its list of faults.
    pub faults: Option<FaultList>,
    /// Data of its status report.
    pub status_data: Option<[u8; STATUS_REPORT_BYTES]>,
}

impl LaserInfo {
    /// Its status report.
    #[must_use]
    pub fn report(&self) -> Option<StatusReport<'_>> {
        self.status_data.as_ref().and_then(|data| StatusReport::new(data).ok())
    }

    /// How its values are to be read: as its configuration says, or its status report; `None` when neither is known.
    #[must_use]
    pub fn measuring_mode(&self) -> Option<MeasuringMode> {
        let of_config = self.config.as_ref().and_then(Config::measuring_mode);
        of_config.or_else(|| self.report().map(|report| report.measuring_mode()))
    }

    /// An S14 measures its 181 beams in one turn, 90 degrees wide; others with 181 beams are 180 degrees wide. Its type says so; where it
    /// has not said its type, the rig does.
    #[must_use]
    pub fn is_s14(&self, settings: &LaserSettings) -> bool {
        match self.type_text.as_str() {
            "" => settings.fov_deg == 90,
            text => text.contains("S14"),
        }
    }

    /// What its configuration would need for the rig; `None` when it is not known.
    #[must_use]
    pub fn differs(&self, settings: &LaserSettings) -> Option<ConfigChange> {
        let config = self.config.as_ref()?;
        Some(ConfigChange::between(config, settings, self.is_s14(settings)))
    }
}
