//! What a laser on a network says of itself.

use biplane_wire::cola::{Dialect, Family};

use crate::session::cola::settings::ColaConfig;
use crate::types::device_name::ShortText;

/// What is known of a laser; fields are empty until it has told.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct ColaInfo {
    /// The dialect in which it answers.
    pub dialect: Option<Dialect>,
    /// Its name, for example `LMS10x_FieldEval`.
    pub name: ShortText,
    /// Its firmware version.
    pub firmware: ShortText,
    /// Its serial number.
    pub serial: ShortText,
    /// Its family, by its name.
    pub family: Option<Family>,
    /// Its state: 0 busy, 1 ready, 2 error.
    pub state: Option<u8>,
    /// How it is set.
    pub config: ColaConfig,
}
