//! The devices of a simulated rig, and their lines.

pub(crate) mod earlier_client;
pub(crate) mod foreign;

use biplane_mock::devices::base::counters::{CountScale, SourceCounts};
use biplane_mock::devices::base::feed::CycleFeed;
use biplane_mock::devices::base::rflex::{RflexDevice, RflexParams};
use biplane_mock::devices::base::roboclaw::{RoboClawDevice, RoboClawParams};
use biplane_mock::devices::base::{BaseDevice, BaseParams};
use biplane_mock::devices::device::Device;
use biplane_mock::devices::inertial::{XsensDevice, XsensParams};
use biplane_mock::devices::lms::scans::feed::{Mirror, MirrorFeed};
use biplane_mock::devices::lms::settings::Variant;
use biplane_mock::devices::lms::{LmsDevice, LmsParams};
use biplane_mock::faults::Faults;
use biplane_mock::rng::Rng;
use biplane_recording::rig::{self, BaseProtocol, InertialUnit, Rig};

use super::line::SimLine;
use super::world::{Felt, Remembering, Room, SameTime, Taken, Wheels};
use super::{Lines, MS};

/// A packet of odometry each tenth of a second.
const SIP_CYCLE_NS: i64 = 100 * MS;

/// A laser's mirror has its own phase.
#[must_use]
pub(crate) fn mirror(seed: u64, stream: u64) -> Mirror {
    let phase = Rng::new(seed, 0x3144 + stream, 0).unit();
    Mirror { phase_ns: (phase * Mirror::TURN_NS as f64) as i64, turn_ns: Mirror::TURN_NS }
}

/// A laser in the room.
#[must_use]
pub(crate) fn laser(params: LmsParams, faults: &Faults, seed: u64, stream: u64) -> Box<dyn Device> {
    let params = faults.laser(LmsParams { mirror: mirror(seed, stream), ..params });
    let feed = MirrorFeed::new(Box::new(Room::new(seed, stream)), Box::new(SameTime));
    Box::new(LmsDevice::new(params, faults.feed(Box::new(feed), stream)))
}

/// The same, whose scans are remembered with the times at which they were taken.
#[must_use]
pub(crate) fn remembered_laser(params: LmsParams, seed: u64, stream: u64, taken: &Taken) -> Box<dyn Device> {
    remembered_laser_turning(LmsParams { mirror: mirror(seed, stream), ..params }, seed, stream, taken)
}

/// The same with the mirror that its parameters say.
#[must_use]
pub(crate) fn remembered_laser_turning(
    params: LmsParams,
    seed: u64,
    stream: u64,
    taken: &Taken,
) -> Box<dyn Device> {
    let source = Remembering { room: Room::new(seed, stream), taken: taken.clone() };
    Box::new(LmsDevice::new(params, Box::new(MirrorFeed::new(Box::new(source), Box::new(SameTime)))))
}

/// The base of a rig, in the room.
#[must_use]
pub(crate) fn base(base: &rig::Base, faults: &Faults) -> Box<dyn Device> {
    let (source, timeline, baud) = (Box::new(Wheels), Box::new(SameTime), base.baud);
    let left_open = faults.base(BaseParams::default()).left_open;
    let Some(scale) = CountScale::of(&base.protocol) else {
        return pioneer(base, BaseParams { left_open, ..BaseParams::default() });
    };
    let feed = Box::new(SourceCounts::new(source, timeline, scale));
    match base.protocol {
        BaseProtocol::RoboClaw { address, .. } => {
            Box::new(RoboClawDevice::new(RoboClawParams { address, baud, ..RoboClawParams::default() }, feed))
        }
        _ => Box::new(RflexDevice::new(RflexParams { baud, left_open, ..RflexParams::default() }, feed)),
    }
}

/// A Pioneer in the room.
#[must_use]
pub(crate) fn pioneer(base: &rig::Base, params: BaseParams) -> Box<dyn Device> {
    let feed = CycleFeed::new(Box::new(Wheels), Box::new(SameTime), SIP_CYCLE_NS);
    Box::new(BaseDevice::new(BaseParams { baud: base.baud, ..params }, Box::new(feed)))
}

/// A home-made base with a RoboClaw.
#[must_use]
pub(crate) fn roboclaw_base() -> rig::Base {
    let protocol = BaseProtocol::RoboClaw {
        address: 0x80,
        wheel_base_m: 0.4,
        metres_per_count_left: 0.0001,
        metres_per_count_right: 0.0001,
    };
    rig::Base { protocol, baud: protocol.default_baud(), ..rig::Base::default() }
}

/// A base that speaks rFLEX.
#[must_use]
pub(crate) fn rflex_base() -> rig::Base {
    let protocol = BaseProtocol::Rflex { counts_per_m: 100_000.0, counts_per_rad: 30_000.0 };
    rig::Base { protocol, baud: protocol.default_baud(), ..rig::Base::default() }
}

/// An inertial unit that an earlier run of ours left idle. Its clock comes round within half a minute.
#[must_use]
pub(crate) fn inertial_unit(unit: &InertialUnit, faults: &Faults, seed: u64) -> Box<dyn Device> {
    let to_round = Rng::new(seed, 0x1412, 0).between(0.0, 300_000.0) as u32;
    let idle = XsensParams {
        left_idle: true,
        baud: unit.baud,
        first_ticks: u32::MAX - to_round,
        ..XsensParams::default()
    };
    Box::new(XsensDevice::new(faults.inertial(idle), Box::new(Felt)))
}

/// A laser that an earlier run of ours left idle at this rate, in one-degree steps.
#[must_use]
pub(crate) fn idle_laser(baud: u32) -> LmsParams {
    LmsParams { baud, variant: Variant::of(180, 100), ..LmsParams::default() }
}

/// Lines of the rig's devices, all idle at the rates of the rig; those faults that act on devices act
/// on the devices in `places`.
#[must_use]
pub(crate) fn idle_lines(rig: &Rig, seed: u64, faults: &Faults, places: &[u64]) -> Lines {
    let of = |stream| if places.contains(&stream) { faults.clone() } else { Faults::default() };
    let laser = |stream, baud| {
        let device = laser(idle_laser(baud), &of(stream), seed, stream);
        SimLine::new(device, seed, stream)
    };
    [
        Some(laser(0, rig.horizontal.baud)),
        rig.vertical.as_ref().map(|vertical| laser(1, vertical.baud)),
        Some(SimLine::new(base(&rig.base, &of(2)), seed, 2)),
        rig.imu.as_ref().map(|unit| SimLine::new(inertial_unit(unit, &of(3), seed), seed, 3)),
    ]
}

/// The template rig with both lasers at this rate.
#[must_use]
pub(crate) fn rig_at(baud: u32) -> Rig {
    let mut rig = Rig::default();
    rig.horizontal.baud = baud;
    if let Some(vertical) = &mut rig.vertical {
        vertical.baud = baud;
    }
    rig
}

/// The same with an inertial unit on a line of this rate, which measures so often.
#[must_use]
pub(crate) fn with_inertial_unit(rig: Rig, baud: u32, rate_hz: u16) -> Rig {
    Rig { imu: Some(InertialUnit { baud, rate_hz, ..InertialUnit::xsens("imu") }), ..rig }
}
