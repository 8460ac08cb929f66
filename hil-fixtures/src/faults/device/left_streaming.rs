//! A rig that an earlier client left as it was: the lasers stream at a rate that the next client does not
//! know, the base has a session open.

use crate::devices::base::BaseParams;
use crate::devices::lms::LmsParams;

/// How it was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeftStreamingParams {
    /// Rate of the lasers, unless another one than 9600 was asked for. Another one than the client expects
    /// has to be searched for.
    pub baud: u32,
}

impl Default for LeftStreamingParams {
    fn default() -> Self {
        Self { baud: 38_400 }
    }
}

impl LeftStreamingParams {
    /// A laser left streaming.
    pub fn leave_laser(self, laser: &mut LmsParams) {
        laser.left_streaming = true;
        laser.power_on_message = false;
        if laser.baud == 9600 {
            laser.baud = self.baud;
        }
    }

    /// A base left open.
    pub fn leave_base(self, base: &mut BaseParams) {
        base.left_open = true;
    }
}
