//! What the inertial unit of a simulated rig says during the capture: messages as `/imu`, or bytes on its
//! line.

use super::devices::through_faults;
use super::times::Times;
use super::{SimulateError, SimulateOptions};
use crate::capture::file::{InertialReads, LineReads};
use crate::devices::telegrams;
use crate::line::{Adapter, transfer_ns};
use crate::rig::inertial::{InertialSample, PERIOD_NS, SimulatedInertial};
use crate::rig::simulated::{SimulatedRig, base_from_laser};
use crate::rng::Rng;
use biplane_recording::Port;
use biplane_recording::messages::Imu;
use biplane_recording::rig::InertialUnit;
use biplane_recording::topics::FRAME_IMU;
use biplane_wire::WireError;

/// From a sample to its message.
const DELAY_NS: i64 = 2_000_000;
/// The first number of the covariance of what is not there (sensor_msgs/Imu).
const NONE: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// From the end of a sample to the first byte of its message on a line.
const LATENCY_NS: i64 = 1_500_000;
/// By how much the clock of a unit on a line is off, one standard deviation, millionths.
const CLOCK_PPM: f64 = 20.0;
/// Nanoseconds of a tick of that clock.
const TICK_NS: f64 = 100_000.0;
/// The line's place among those of a rig.
const PLACE: u64 = 3;
/// Time between two replies of a start-up.
const REPLY_PERIOD_NS: i64 = 100_000_000;

pub(crate) fn record_inertial(
    rig: &SimulatedRig,
    unit: &InertialUnit,
    times: &Times,
    options: &SimulateOptions,
) -> InertialReads {
    let count = (times.end_ns - times.stream_ns - DELAY_NS) / PERIOD_NS;
    let read = |sample: InertialSample| {
        let message = Imu {
            frame_id: FRAME_IMU.to_owned(),
            orientation_covariance: NONE,
            angular_rad_s: sample.turn_rad_s,
            acceleration_m_s2: sample.force_m_s2,
            ..Imu::default()
        };
        ([sample.time_ns, sample.time_ns + DELAY_NS], message)
    };
    samples(rig, unit, times, options, PERIOD_NS).take(count.max(0) as usize).map(read).collect()
}

/// What a unit on the robot feels from when the devices stream on.
fn samples(
    rig: &SimulatedRig,
    unit: &InertialUnit,
    times: &Times,
    options: &SimulateOptions,
    period_ns: i64,
) -> impl Iterator<Item = InertialSample> {
    let mount = base_from_laser(&unit.mount);
    let map_from_unit = move |time_ns: i64| rig.map_from_base(time_ns).then(&mount);
    let mut source = SimulatedInertial::new(map_from_unit, options.params.inertial, options.seed);
    let first_ns = times.stream_ns;
    (0..).map(move |number| source.sample_over(first_ns + number * period_ns, period_ns))
}

/// The same of a unit on a line, as the bytes that it sends; and how many samples they hold.
pub(crate) fn record_inertial_line(
    rig: &SimulatedRig,
    unit: &InertialUnit,
    times: &Times,
    options: &SimulateOptions,
) -> Result<(LineReads, usize), SimulateError> {
    let period_ns = 1_000_000_000 / i64::from(unit.rate_hz.max(1));
    let mut clock = UnitClock::new(options.seed);
    let mut line = UnitLine {
        adapter: Adapter::new(options.reads, options.seed, PLACE),
        baud: unit.baud,
        free_ns: i64::MIN,
    };
    if options.start_up {
        for (reply, number) in telegrams::inertial_start_up(unit.rate_hz)?.into_iter().zip(1..) {
            line.say(reply, number * REPLY_PERIOD_NS);
        }
    }
    let mut count = 0;
    for sample in samples(rig, unit, times, options, period_ns) {
        // It is the mean of the time that ends here.
        let end_ns = sample.time_ns + period_ns / 2;
        let message = clock.message(end_ns, &sample)?;
        let start_ns = end_ns + LATENCY_NS;
        if start_ns + transfer_ns(message.len(), unit.baud) > times.end_ns {
            break;
        }
        line.say(message, start_ns);
        count += 1;
    }
    let reads = through_faults(line.adapter.finish(), &options.faults, PLACE);
    Ok((LineReads::received(Port::Imu, reads), count))
}

/// The clock and the count of a unit.
struct UnitClock {
    first_ticks: u32,
    rate: f64,
    counter: u16,
}

impl UnitClock {
    fn new(seed: u64) -> Self {
        let mut rng = Rng::new(seed, 0xC10C, PLACE.cast_signed());
        let rate = 1.0 + CLOCK_PPM * 1e-6 * rng.normal();
        // Switched on at some time; it may come round during the drive.
        let (first_ticks, counter) = (rng.bits() as u32, rng.bits() as u16);
        Self { first_ticks, rate, counter }
    }

    fn message(&mut self, end_ns: i64, sample: &InertialSample) -> Result<Vec<u8>, WireError> {
        let ticks = (end_ns as f64 * self.rate / TICK_NS).floor() as i64 as u32;
        self.counter = self.counter.wrapping_add(1);
        telegrams::inertial(self.counter, self.first_ticks.wrapping_add(ticks), sample)
    }
}

/// A unit's line.
struct UnitLine {
    adapter: Adapter,
    baud: u32,
    free_ns: i64,
}

impl UnitLine {
    fn say(&mut self, bytes: Vec<u8>, start_ns: i64) {
        let start_ns = start_ns.max(self.free_ns);
        let byte_ns = transfer_ns(1, self.baud);
        for (index, byte) in bytes.into_iter().enumerate() {
            self.free_ns = start_ns + transfer_ns(index + 1, self.baud);
            self.adapter.push(byte, self.free_ns, byte_ns);
        }
    }
}
