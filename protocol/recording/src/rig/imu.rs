//! The inertial unit in `rig.toml`: where it sits, and how its samples come.

use super::table::Table;
use super::{Mount, RigError};

/// An inertial unit: turn rates and accelerations.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct InertialUnit {
    /// How its samples come.
    pub protocol: InertialProtocol,
    /// Where it sits. Its own axes: x forward, y left, z up, as those of the base, when nothing is said.
    pub mount: Mount,
}

/// How the samples of an inertial unit come.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum InertialProtocol {
    /// With the recording, as `/imu`: of an imported bag, or of a simulated drive.
    #[default]
    None,
}

impl InertialProtocol {
    /// The word in `rig.toml`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
        }
    }
}

impl InertialUnit {
    pub(crate) fn parse(
        table: &Table,
        mount_of: impl Fn(&Table, Mount) -> Result<Mount, RigError>,
    ) -> Result<Self, RigError> {
        table.only(&["protocol", "mount"])?;
        table.word("protocol", "none", &["none"])?;
        let mount = mount_of(table, Mount::default())?;
        Ok(Self { protocol: InertialProtocol::None, mount })
    }
}
