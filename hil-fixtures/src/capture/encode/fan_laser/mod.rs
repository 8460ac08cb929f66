//! Scans as a laser of today would have sent them (SICK on a network, Hokuyo): on its own clock, with what it
//! says of itself in front.

mod cola;
mod scip;

pub(crate) use cola::ColaLine;
pub(crate) use scip::ScipLine;

use super::EncodeError;
use crate::devices::device::Device;
use crate::line::SerialRead;
use biplane_recording::Topic;
use biplane_recording::messages::LaserScan;

/// A laser says who it is so long before its first scan, and has begun its clock as long before that.
const OPENING_NS: i64 = 500_000_000;
/// A client reads the answer within this time, nanoseconds.
const ANSWERED_NS: i64 = 20_000_000;

/// What a client asks such a device, each thing once, and what it answers.
fn opening(
    device: &mut dyn Device,
    requests: &[Vec<u8>],
    first_ns: i64,
) -> (Vec<SerialRead>, Vec<(i64, Vec<u8>)>) {
    let (mut asked, mut answers) = (Vec::new(), Vec::new());
    device.connected(0);
    for (request, number) in requests.iter().zip(0..) {
        let at_ns = number * ANSWERED_NS;
        asked.push(SerialRead { time_ns: first_ns - OPENING_NS + at_ns, bytes: request.clone() });
        device.handle(at_ns, request);
        let (mut out, mut due_ns) = (Vec::new(), at_ns);
        while due_ns < at_ns + ANSWERED_NS {
            due_ns = device.poll(due_ns, &mut out).max(due_ns + 1);
        }
        answers.push((first_ns - OPENING_NS + at_ns + ANSWERED_NS, out));
    }
    (asked, answers)
}

/// A scan that such a laser does not send.
fn not_sent(laser: &'static str, topic: Topic, number: u64, scan: &LaserScan, expected: &str) -> EncodeError {
    EncodeError::OtherLaser {
        laser,
        topic: topic.name(),
        number,
        beams: scan.ranges_m.len(),
        first_deg: f64::from(scan.angle_min_rad).to_degrees(),
        step_deg: f64::from(scan.angle_increment_rad).to_degrees(),
        expected: expected.to_owned(),
    }
}
