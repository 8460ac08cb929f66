//! A scan of a Hokuyo laser as ranges in meters, in the laser's own frame (x straight ahead, y to the left),
//! with the times that the device states.

use biplane_wire::scip::{Delivery, Parameters, Reading, Scan, ScanRequest};

use crate::session::cola::scan::MAX_COLA_BEAMS;
use crate::session::scip::clock::ScanTime;

/// Most beams of a scan: those of a UTM-30LX are 1081, of its sample units 1101.
pub(crate) const MAX_SCIP_BEAMS: usize = MAX_COLA_BEAMS;
/// A device that reaches farther than this has the codes of a UTM, the others those of a URG-04LX, in mm.
const CODES_OF_UTM_FROM_MM: u32 = 20_000;

/// A scan, decoded.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct ScipScan {
    /// Index of the reply's first byte in the stream.
    pub offset: u64,
    /// Bytes of the reply.
    pub length: usize,
    /// The device's times of it.
    pub time: ScanTime,
    /// Count of scans that came.
    pub counter: u16,
    /// From step 0 to the first beam, seconds.
    pub first_beam_s: f64,
    /// From step 0 to the last step that was asked for, seconds: no scan is sent before.
    pub last_step_s: f64,
    /// From beam to beam, seconds.
    pub beam_s: f64,
    /// Direction of the first beam, degrees from straight ahead, counter-clockwise.
    pub first_deg: f64,
    /// From beam to beam, degrees.
    pub step_deg: f64,
    /// From a scan to the next, seconds.
    pub scan_s: f64,
    /// Shortest and longest range, meters.
    pub range_m: [f32; 2],
    /// Ranges in meters, `+inf` for nothing in range, NaN for invalid.
    pub ranges_m: heapless::Vec<f32, MAX_SCIP_BEAMS>,
    /// Intensities, one a beam, device units; empty where the reply has none.
    pub intensities: heapless::Vec<u16, MAX_SCIP_BEAMS>,
}

/// Turns of the mirror from a scan to the next.
pub(crate) fn turns(request: &ScanRequest) -> f64 {
    match request.delivery {
        Delivery::Once => 1.0,
        Delivery::Stream { skip, .. } => 1.0 + f64::from(skip),
    }
}

impl ScipScan {
    /// Takes over a scan of such a device; false when it has too many beams.
    pub(crate) fn take(&mut self, scan: &Scan<'_>, parameters: &Parameters) -> bool {
        let request = &scan.request;
        if !(1..=MAX_SCIP_BEAMS).contains(&request.values()) {
            return false;
        }
        let step_s = parameters.step_ns() * 1e-9;
        let cluster = f64::from(request.steps_per_value());
        self.first_beam_s = f64::from(request.first_step) * step_s;
        self.last_step_s = f64::from(request.last_step) * step_s;
        self.beam_s = cluster * step_s;
        self.step_deg = cluster * parameters.step_deg();
        let from_front = f64::from(request.first_step) - f64::from(parameters.front_step);
        self.first_deg = from_front * parameters.step_deg();
        self.scan_s = turns(request) * parameters.turn_ns() * 1e-9;
        self.range_m = [meters(parameters.min_mm), meters(parameters.max_mm)];
        self.ranges_m.clear();
        self.intensities.clear();
        // Of several echoes of a step the nearest comes first.
        for reading in scan.values.iter().filter(|reading| !reading.is_further) {
            // There is room: the count was checked.
            let _ = self.ranges_m.push(range_m(&reading, parameters));
            if let Some(intensity) = reading.intensity {
                let _ = self.intensities.push(u16::try_from(intensity).unwrap_or(u16::MAX));
            }
        }
        true
    }
}

fn meters(mm: u32) -> f32 {
    (f64::from(mm) * 1e-3) as f32
}

/// A range, or what its code means: below the shortest range no value is a distance.
fn range_m(reading: &Reading, parameters: &Parameters) -> f32 {
    let is_utm = parameters.max_mm > CODES_OF_UTM_FROM_MM;
    match reading.range_mm {
        range if range > parameters.max_mm => f32::INFINITY,
        range if range >= parameters.min_mm.max(1) => meters(range),
        // No object, or one so far away that it looks near.
        1 if is_utm => f32::INFINITY,
        0 | 6 if !is_utm => f32::INFINITY,
        _ => f32::NAN,
    }
}
