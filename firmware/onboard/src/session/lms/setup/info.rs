//! What a laser says of itself.

use biplane_wire::lms::{Config, MeasuringMode, STATUS_REPORT_BYTES, Status, StatusReport};

use crate::session::lms::health::FaultList;
use crate::session::lms::setup::requested::ConfigChange;
use crate::session::lms::setup::settings::LaserSettings;
use crate::types::device_name::ShortText;

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

    /// How its values are to be read: as its configuration says, or its status report; `None` when neither is
    /// known.
    #[must_use]
    pub fn measuring_mode(&self) -> Option<MeasuringMode> {
        let of_config = self.config.as_ref().and_then(Config::measuring_mode);
        of_config.or_else(|| self.report().map(|report| report.measuring_mode()))
    }

    /// An S14 measures its 181 beams in one turn, 90 degrees wide; others with 181 beams are 180 degrees
    /// wide. Its type says so; where it has not said its type, the rig does.
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
