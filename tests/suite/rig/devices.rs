//! The devices of a simulated rig, and their lines.

use biplane_mock::base_device::feed::CycleFeed;
use biplane_mock::base_device::{BaseDevice, BaseParams};
use biplane_mock::lms_device::feed::{Mirror, MirrorFeed};
use biplane_mock::lms_device::settings::Variant;
use biplane_mock::lms_device::{LmsDevice, LmsParams};
use biplane_mock::rng::Rng;

use super::MS;
use super::line::{MakeDevice, SimLine};
use super::world::{Room, SameTime, Wheels};

/// A packet of odometry each tenth of a second.
const SIP_CYCLE_NS: i64 = 100 * MS;

/// A laser's mirror has its own phase.
#[must_use]
pub fn mirror(seed: u64, stream: u64) -> Mirror {
    let phase = Rng::new(seed, 0x3144 + stream, 0).unit();
    Mirror { phase_ns: (phase * Mirror::TURN_NS as f64) as i64, turn_ns: Mirror::TURN_NS }
}

/// The laser as found, or just switched on: then at 9600 Bd, idle, with what its EEPROM holds.
#[must_use]
pub fn laser(params: LmsParams, seed: u64, stream: u64) -> MakeDevice {
    Box::new(move |power_on| {
        let mut params = LmsParams { mirror: mirror(seed, stream), ..params.clone() };
        if power_on {
            params = LmsParams { baud: 9600, left_streaming: false, power_on_message: true, ..params };
        }
        let feed = MirrorFeed::new(Box::new(Room::new(seed, stream)), Box::new(SameTime));
        Box::new(LmsDevice::new(params, Box::new(feed)))
    })
}

/// A Pioneer as found, or just reset.
#[must_use]
pub fn base(params: BaseParams) -> MakeDevice {
    Box::new(move |power_on| {
        let mut params = params.clone();
        if power_on {
            params = BaseParams { left_open: false, ..params };
        }
        let feed = CycleFeed::new(Box::new(Wheels), Box::new(SameTime), SIP_CYCLE_NS);
        Box::new(BaseDevice::new(params, Box::new(feed)))
    })
}

/// A laser that an earlier run of ours left idle at this rate, in one-degree steps.
#[must_use]
pub fn idle_laser(baud: u32) -> LmsParams {
    LmsParams { baud, variant: Variant::of(180, 100), ..LmsParams::default() }
}

/// Lines of two lasers and a Pioneer, all idle at the rates of the rig.
#[must_use]
pub fn idle_lines(baud: u32, seed: u64) -> [Option<SimLine>; 3] {
    let laser = |stream| Some(SimLine::new(laser(idle_laser(baud), seed, stream), seed, stream));
    [laser(0), laser(1), Some(SimLine::new(base(BaseParams::default()), seed, 2))]
}
