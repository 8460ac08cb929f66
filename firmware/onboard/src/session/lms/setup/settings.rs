//! What a laser shall be set to.

use biplane_recording::rig;
use biplane_wire::lms::Unit;

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
    /// How far it shall measure, meters; `None`: as it is set.
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
