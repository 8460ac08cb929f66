//! The devices of a simulated rig, and their lines.

use biplane_mock::base_device::feed::CycleFeed;
use biplane_mock::base_device::{BaseDevice, BaseParams};
use biplane_mock::device::Device;
use biplane_mock::faults::Faults;
use biplane_mock::lms_device::feed::{Mirror, MirrorFeed};
use biplane_mock::lms_device::settings::Variant;
use biplane_mock::lms_device::{LmsDevice, LmsParams};
use biplane_mock::rng::Rng;

use super::MS;
use super::line::SimLine;
use super::world::{Room, SameTime, Wheels};

/// A packet of odometry each tenth of a second.
const SIP_CYCLE_NS: i64 = 100 * MS;

/// A laser's mirror has its own phase.
#[must_use]
pub fn mirror(seed: u64, stream: u64) -> Mirror {
    let phase = Rng::new(seed, 0x3144 + stream, 0).unit();
    Mirror { phase_ns: (phase * Mirror::TURN_NS as f64) as i64, turn_ns: Mirror::TURN_NS }
}

/// A laser in the room.
#[must_use]
pub fn laser(params: LmsParams, faults: &Faults, seed: u64, stream: u64) -> Box<dyn Device> {
    let params = faults.laser(LmsParams { mirror: mirror(seed, stream), ..params });
    let feed = MirrorFeed::new(Box::new(Room::new(seed, stream)), Box::new(SameTime));
    Box::new(LmsDevice::new(params, faults.feed(Box::new(feed), stream)))
}

/// A Pioneer in the room.
#[must_use]
pub fn base(params: BaseParams, faults: &Faults) -> Box<dyn Device> {
    let feed = CycleFeed::new(Box::new(Wheels), Box::new(SameTime), SIP_CYCLE_NS);
    Box::new(BaseDevice::new(faults.base(params), Box::new(feed)))
}

/// A laser that an earlier run of ours left idle at this rate, in one-degree steps.
#[must_use]
pub fn idle_laser(baud: u32) -> LmsParams {
    LmsParams { baud, variant: Variant::of(180, 100), ..LmsParams::default() }
}

/// Lines of two lasers and a Pioneer, all idle at the rates of the rig; those faults that act on devices act on the devices in `places`.
#[must_use]
pub fn idle_lines(baud: u32, seed: u64, faults: &Faults, places: &[u64]) -> [Option<SimLine>; 3] {
    let of = |stream| if places.contains(&stream) { faults.clone() } else { Faults::default() };
    let laser = |stream| {
        let device = laser(idle_laser(baud), &of(stream), seed, stream);
        Some(SimLine::new(device, seed, stream))
    };
    [laser(0), laser(1), Some(SimLine::new(base(BaseParams::default(), &of(2)), seed, 2))]
}
