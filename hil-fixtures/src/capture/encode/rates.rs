//! Which rate a line needs, judged by the stamps of what it has to carry.
//!
//! Logs of lasers hold stamps that no line could keep, because the computer wrote them when it came to it:
//! two scans a millisecond apart, then half a second of nothing. On a fast line each telegram still begins
//! near its stamp.

use crate::devices::base::base_encoder::BaseEncoder;
use crate::devices::scip::{ScipLink, ScipParams};
use crate::line::transfer_ns;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::{Laser, LaserProtocol};
use biplane_recording::{AnyMessage, Port, ReadError, Reader, Rig, Topic};

/// A line is crowded when more than this share of its telegrams has to wait.
const CROWDED: f64 = 0.01;
/// The fastest rates of an LMS 2xx, of a Hokuyo laser and of a base, Bd.
const FASTEST_LASER: u32 = 500_000;
const FASTEST_HOKUYO: u32 = 750_000;
const FASTEST_BASE: u32 = 115_200;

/// What one line carries.
#[derive(Default)]
struct Load {
    free_ns: Option<i64>,
    telegrams: u64,
    waited: u64,
}

impl Load {
    fn add(&mut self, stamp_ns: i64, busy_ns: i64) {
        let start_ns = self.free_ns.map_or(stamp_ns, |free_ns| free_ns.max(stamp_ns));
        self.waited += u64::from(start_ns > stamp_ns);
        self.telegrams += 1;
        self.free_ns = Some(start_ns + busy_ns);
    }

    fn is_crowded(&self) -> bool {
        self.waited as f64 > CROWDED * self.telegrams as f64
    }
}

/// Whether a laser's line has a rate.
fn has_rate(laser: &Laser, hokuyo: &ScipParams) -> bool {
    match laser.protocol {
        LaserProtocol::Lms2xx => true,
        LaserProtocol::Cola(_) => false,
        LaserProtocol::Scip(_) => laser.address().is_none() && matches!(hokuyo.link, ScipLink::Serial(_)),
    }
}

/// Bytes of a scan on a line with a rate.
fn line_bytes(laser: &Laser, scan: &LaserScan, hokuyo: &ScipParams) -> Option<usize> {
    let beams = scan.ranges_m.len();
    has_rate(laser, hokuyo).then(|| match laser.is_lms2xx() {
        true => 2 * beams + 10,
        // Three characters a value, two more in a line of 64, and the lines in front.
        false => 3 * beams * 66 / 64 + 30,
    })
}

/// Raises the lines of the rig that its recording would crowd; which ones, and to what.
pub(crate) fn raise(
    reader: &Reader,
    rig: &mut Rig,
    hokuyo: &ScipParams,
) -> Result<Vec<(Port, u32)>, ReadError> {
    let mut loads = [Load::default(), Load::default(), Load::default()];
    let base_bytes = BaseEncoder::new(rig.base.protocol).exchange_bytes();
    let vertical = rig.vertical.clone().unwrap_or_else(|| rig.horizontal.clone());
    let busy_ns = |laser: &Laser, scan: &LaserScan| {
        line_bytes(laser, scan, hokuyo).map_or(0, |bytes| transfer_ns(bytes, laser.baud))
    };
    for entry in reader.messages() {
        let entry = entry?;
        match (entry.topic, entry.decode()?) {
            (Some(Topic::ScanHorizontal), AnyMessage::Scan(scan)) => {
                loads[0].add(scan.stamp_ns, busy_ns(&rig.horizontal, &scan));
            }
            (Some(Topic::ScanVertical), AnyMessage::Scan(scan)) => {
                loads[1].add(scan.stamp_ns, busy_ns(&vertical, &scan));
            }
            (Some(Topic::Odom), AnyMessage::Odometry(odometry)) => {
                loads[2].add(odometry.stamp_ns, transfer_ns(base_bytes, rig.base.baud));
            }
            _ => {}
        }
    }
    let mut raised = Vec::new();
    let mut lift = |load: &Load, port, baud: &mut u32, fastest: u32| {
        if load.is_crowded() && *baud < fastest {
            *baud = fastest;
            raised.push((port, fastest));
        }
    };
    let lasers = [(Port::Horizontal, Some(&mut rig.horizontal)), (Port::Vertical, rig.vertical.as_mut())];
    for (load, (port, laser)) in loads.iter().zip(lasers) {
        let Some(laser) = laser.filter(|laser| has_rate(laser, hokuyo)) else { continue };
        let fastest = if laser.is_lms2xx() { FASTEST_LASER } else { FASTEST_HOKUYO };
        lift(load, port, &mut laser.baud, fastest);
    }
    lift(&loads[2], Port::Base, &mut rig.base.baud, FASTEST_BASE);
    Ok(raised)
}
