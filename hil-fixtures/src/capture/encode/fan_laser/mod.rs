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

/// A device's own clock, by which its scans are stamped.
#[derive(Clone, Copy, Debug)]
struct OwnClock {
    /// When it was at its first value.
    begun_ns: i64,
    /// The last scan's time on it.
    last_ns: i64,
}

impl OwnClock {
    /// Before the device has said who it is.
    const NOT_BEGUN: Self = Self { begun_ns: 0, last_ns: i64::MIN };

    /// Begins so that the device can say who it is before its first scan is sent.
    fn begin(&mut self, first_ns: i64) {
        self.begun_ns = first_ns - 2 * OPENING_NS;
    }

    /// The time that a scan gets: its own, or a tick after the last one's. Such a clock never steps back.
    fn mark_ns(&mut self, true_ns: i64, tick_ns: i64) -> i64 {
        self.last_ns = true_ns.max(self.last_ns.saturating_add(tick_ns));
        self.last_ns
    }
}

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
