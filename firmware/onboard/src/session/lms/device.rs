//! The laser of a session: what the rig asks of it, what it has told, and what was seen of it.

use biplane_wire::lms::{Reply, StatusReport};

use crate::session::lms::health::{FaultList, LaserHealth};
use crate::session::lms::setup::info::LaserInfo;
use crate::session::lms::setup::requested::ConfigChange;
use crate::session::lms::setup::settings::LaserSettings;
use crate::types::device_name::{ShortText, printable};

/// What the session is for.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Goal {
    Stream,
    Probe,
}

/// What a reply says that was not known.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum News {
    /// Nothing that others must know.
    None,
    /// How the device is set, and so how its scans are to be read.
    Settings,
    /// It is another type than before.
    Type(ShortText),
}

/// One laser.
#[derive(Debug)]
pub(crate) struct Device {
    pub(crate) settings: LaserSettings,
    pub(crate) goal: Goal,
    pub(crate) info: LaserInfo,
    pub(crate) health: LaserHealth,
}

impl Device {
    pub(crate) fn new(settings: LaserSettings, goal: Goal) -> Self {
        Self { settings, goal, info: LaserInfo::default(), health: LaserHealth::default() }
    }

    pub(crate) fn is_s14(&self) -> bool {
        self.info.is_s14(&self.settings)
    }

    /// What its configuration needs for the rig.
    pub(crate) fn change(&self) -> ConfigChange {
        self.info.differs(&self.settings).unwrap_or_default()
    }

    /// Field of view, degrees, and step, hundredths of a degree, that the rig asks for.
    pub(crate) fn wanted_variant(&self) -> (u16, u16) {
        (self.settings.fov_deg, self.settings.resolution_cdeg)
    }

    /// Values of a scan of the variant in force.
    pub(crate) fn beams(&self) -> u16 {
        if self.is_s14() {
            return 181;
        }
        let (fov_deg, resolution_cdeg) = self.info.variant.unwrap_or(self.wanted_variant());
        fov_deg.saturating_mul(100) / resolution_cdeg.max(1) + 1
    }

    /// Keeps what replies tell of the laser, whoever asked for them.
    pub(crate) fn learn(&mut self, reply: &Reply<'_>) -> News {
        match reply {
            Reply::Type { text } => {
                let kept = printable(*text);
                if kept == self.info.type_text {
                    return News::None;
                }
                self.info.type_text = kept.clone();
                return News::Type(kept);
            }
            Reply::Config(config) | Reply::ConfigWritten { config, .. } => {
                self.info.config = Some(config.clone());
            }
            Reply::Variant { angle_deg, resolution_cdeg, .. } => {
                self.info.variant = Some((*angle_deg, *resolution_cdeg));
            }
            Reply::Mode(_) => {}
            Reply::Status(status) => {
                self.learn_status(status);
                return News::None;
            }
            Reply::Errors(list) => {
                self.info.faults = Some(FaultList::of(list.faults()));
                return News::None;
            }
            _ => return News::None,
        }
        News::Settings
    }

    fn learn_status(&mut self, status: &StatusReport<'_>) {
        self.info.firmware = printable(status.version());
        self.info.has_fault = Some(status.has_fault());
        self.info.variant = Some((status.angle_deg(), status.resolution_cdeg()));
        self.info.status_data = status.data().first_chunk().copied();
    }
}
