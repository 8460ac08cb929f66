//! Which rate a line needs, judged by the stamps of what it has to carry.
//!
//! Logs of lasers hold stamps that no line could keep, because the computer wrote them when it came to it:
//! two scans a millisecond apart, then half a second of nothing. On a fast line each telegram still begins
//! near its stamp.

use crate::devices::base::base_encoder::BaseEncoder;
use crate::line::transfer_ns;
use biplane_recording::{AnyMessage, Port, ReadError, Reader, Rig, Topic};

/// A line is crowded when more than this share of its telegrams has to wait.
const CROWDED: f64 = 0.01;
/// The fastest rates of an LMS 2xx and of a base, Bd.
const FASTEST_LASER: u32 = 500_000;
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

/// Raises the lines of the rig that its recording would crowd; which ones, and to what.
pub(crate) fn raise(reader: &Reader, rig: &mut Rig) -> Result<Vec<(Port, u32)>, ReadError> {
    let mut loads = [Load::default(), Load::default(), Load::default()];
    let base_bytes = BaseEncoder::new(rig.base.protocol).exchange_bytes();
    let vertical_baud = rig.vertical.as_ref().map_or(rig.horizontal.baud, |laser| laser.baud);
    for entry in reader.messages() {
        let entry = entry?;
        let scan_bytes = |beams: usize| 2 * beams + 10;
        match (entry.topic, entry.decode()?) {
            (Some(Topic::ScanHorizontal), AnyMessage::Scan(scan)) => {
                let busy_ns = transfer_ns(scan_bytes(scan.ranges_m.len()), rig.horizontal.baud);
                loads[0].add(scan.stamp_ns, busy_ns);
            }
            (Some(Topic::ScanVertical), AnyMessage::Scan(scan)) => {
                loads[1].add(scan.stamp_ns, transfer_ns(scan_bytes(scan.ranges_m.len()), vertical_baud));
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
    lift(&loads[0], Port::Horizontal, &mut rig.horizontal.baud, FASTEST_LASER);
    if let Some(vertical) = &mut rig.vertical {
        lift(&loads[1], Port::Vertical, &mut vertical.baud, FASTEST_LASER);
    }
    lift(&loads[2], Port::Base, &mut rig.base.baud, FASTEST_BASE);
    Ok(raised)
}
