//! A rig that an earlier client left as it was: the lasers stream at a rate that the next client does not
//! know, the base has a session open, the inertial unit measures.

use crate::devices::base::BaseParams;
use crate::devices::inertial::XsensParams;
use crate::devices::inertial::outputs::Outputs;
use crate::devices::lms::LmsParams;

/// Measurements a second of a unit that was left measuring.
const LEFT_HZ: u16 = 50;

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

    /// An inertial unit left measuring, with all that a client needs but at a rate of its own.
    pub fn leave_inertial(self, unit: &mut XsensParams) {
        unit.left_idle = false;
        unit.outputs = Outputs::whole(LEFT_HZ);
    }
}
