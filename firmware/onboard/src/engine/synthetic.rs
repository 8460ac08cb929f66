//! A robot in a rectangular room, in closed form: what its devices send, and where it truly is. For tests.
//!
//! The room spans x in -3..7 and y in -2..3 m of the map; the map's origin is where the robot starts. It
//! stands for a second, then drives straight ahead at 0.5 m/s. Both lasers sit in the base's origin; the
//! vertical one lies flat too (its scans are only stamped and posed here).

use biplane_geometry::PortableMath;
use biplane_recording::rig::{Laser, Mount};
use biplane_recording::{Port, Rig};
use biplane_wire::lms::{MIRROR_TURN_NS, Scan, Status, Unit};
use biplane_wire::p2os::Sip;

use crate::types::byte_time::byte_time_ns;

const MS: i64 = 1_000_000;
/// Where the clock starts, nanoseconds.
pub(crate) const START_NS: i64 = 1_000_000_000_000_000_000;

/// A read of one line.
#[derive(Clone, Debug)]
pub(crate) struct Read {
    pub time_ns: i64,
    pub port: Port,
    pub bytes: Vec<u8>,
}

pub(crate) fn rig() -> Rig {
    let mount = Mount::default();
    let horizontal = Laser { mount, ..Laser::horizontal() };
    let vertical = Laser { mount, ..Laser::vertical() };
    Rig { horizontal, vertical: Some(vertical), ..Rig::default() }
}

/// Distance driven at a time after the start, meters.
pub(crate) fn driven_m(since_ns: i64) -> f64 {
    0.5 * ((since_ns - 1000 * MS).max(0) as f64 * 1e-9)
}

/// True stamps of the scans of a laser whose first scan begins `phase_ns` after the start: one in 8 at 38400
/// Bd.
pub(crate) fn scan_times_ns(phase_ns: i64, seconds: i64) -> impl Iterator<Item = i64> {
    let last = seconds * 1_000_000_000;
    (0..).map(move |n| phase_ns + n * 8 * MIRROR_TURN_NS).take_while(move |t| *t < last)
}

fn range_m(x_m: f64, angle_rad: f64) -> f64 {
    let (sin, cos) = angle_rad.portable_sin_cos();
    let to_x = if cos > 0.0 { (7.0 - x_m) / cos } else { (-3.0 - x_m) / cos };
    let to_y = if sin > 0.0 { 3.0 / sin } else { -2.0 / sin };
    match (cos.abs() > 1e-9, sin.abs() > 1e-9) {
        (true, true) => to_x.min(to_y),
        (true, false) => to_x,
        _ => to_y,
    }
}

fn scan(t0_ns: i64) -> Vec<u8> {
    let values = (0..181)
        .map(|beam| {
            let angle_rad = f64::from(beam - 90).to_radians();
            let taken_ns = t0_ns + i64::from(beam) * 37_000;
            (range_m(driven_m(taken_ns), angle_rad) * 100.0).round() as u16
        })
        .collect();
    let scan = Scan { unit: Unit::Cm, values, status: Status::OK, ..Scan::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    bytes
}

fn report(at_ns: i64) -> Vec<u8> {
    let sip = Sip { x_raw: (driven_m(at_ns) * 1000.0).round() as u16, ..Sip::default() };
    let mut bytes = vec![0; sip.encoded_len()];
    sip.emit(&mut bytes).expect("it fits");
    bytes
}

/// A telegram whose first byte leaves at `from_ns`, in reads of at most `chunk` bytes that come late by a
/// little.
fn reads(port: Port, from_ns: i64, baud: u32, chunk: usize, bytes: &[u8]) -> Vec<Read> {
    let (mut sent, mut last_ns) = (0, from_ns);
    let pieces = bytes.chunks(chunk).map(|piece| {
        sent += piece.len() as i64;
        let late_ns = (from_ns / 7919 + sent * 131) % 300_000;
        last_ns = last_ns.max(from_ns + sent * byte_time_ns(baud) + late_ns);
        Read { time_ns: last_ns, port, bytes: piece.to_vec() }
    });
    pieces.collect()
}

/// Everything that the three devices send in so many seconds, in order of time.
pub(crate) fn drive(seconds: i64, chunk: usize) -> Vec<Read> {
    let mut all = Vec::new();
    for (port, phase_ns) in [(Port::Horizontal, 20 * MS), (Port::Vertical, 51 * MS)] {
        for t0_ns in scan_times_ns(phase_ns, seconds) {
            all.extend(reads(port, t0_ns + MIRROR_TURN_NS, 38400, chunk, &scan(t0_ns)));
        }
    }
    for at_ns in (0..seconds * 10).map(|n| n * 100 * MS + 7 * MS) {
        all.extend(reads(Port::Base, at_ns, 9600, chunk, &report(at_ns)));
    }
    for read in &mut all {
        read.time_ns += START_NS;
    }
    all.sort_by_key(|read| read.time_ns);
    all
}
