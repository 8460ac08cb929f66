//! What the inertial unit of a simulated rig says during the capture.

use super::SimulateOptions;
use super::times::Times;
use crate::capture::file::InertialReads;
use crate::rig::inertial::{PERIOD_NS, SimulatedInertial};
use crate::rig::simulated::{SimulatedRig, base_from_laser};
use biplane_recording::messages::Imu;
use biplane_recording::rig::InertialUnit;
use biplane_recording::topics::FRAME_IMU;

/// From a sample to its message.
const DELAY_NS: i64 = 2_000_000;
/// The first number of the covariance of what is not there (sensor_msgs/Imu).
const NONE: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

pub(crate) fn record_inertial(
    rig: &SimulatedRig,
    unit: &InertialUnit,
    times: &Times,
    options: &SimulateOptions,
) -> InertialReads {
    let mount = base_from_laser(&unit.mount);
    let map_from_unit = |time_ns: i64| rig.map_from_base(time_ns).then(&mount);
    let mut source = SimulatedInertial::new(map_from_unit, options.params.inertial, options.seed);
    let count = (times.end_ns - times.stream_ns - DELAY_NS) / PERIOD_NS;
    let read = |number: i64| {
        let sample = source.sample(times.stream_ns + number * PERIOD_NS);
        let message = Imu {
            frame_id: FRAME_IMU.to_owned(),
            orientation_covariance: NONE,
            angular_rad_s: sample.turn_rad_s,
            acceleration_m_s2: sample.force_m_s2,
            ..Imu::default()
        };
        ([sample.time_ns, sample.time_ns + DELAY_NS], message)
    };
    (0..count).map(read).collect()
}
