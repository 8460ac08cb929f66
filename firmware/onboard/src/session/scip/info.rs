//! What a Hokuyo laser says of itself.

use biplane_wire::scip::Parameters;

use crate::types::device_name::ShortText;

/// What is known of a laser; fields are empty until it has told.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct ScipInfo {
    /// The rate at which it answered on a serial line, bits per second.
    pub found_baud: Option<u32>,
    /// Its model, for example `UTM-30LX(Hokuyo Automatic Co.,Ltd.)`.
    pub model: ShortText,
    /// Its firmware version.
    pub firmware: ShortText,
    /// Its serial number.
    pub serial: ShortText,
    /// Its state in its own words.
    pub state: ShortText,
    /// Whether its laser is on: `ON` or `OFF`.
    pub laser: ShortText,
    /// Its geometry, reach and rate.
    pub parameters: Option<Parameters>,
}
