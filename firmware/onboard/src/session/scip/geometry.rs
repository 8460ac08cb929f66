//! Geometry of a device that has not told it: a recording that begins behind its answers.

use biplane_wire::scip::{Parameters, ScanRequest};

const fn parameters(reach_mm: [u32; 2], steps: u32, [first, front, last]: [u16; 3], rpm: u32) -> Parameters {
    let [min_mm, max_mm] = reach_mm;
    Parameters {
        min_mm,
        max_mm,
        steps_per_turn: steps,
        first_step: first,
        last_step: last,
        front_step: front,
        rpm,
    }
}

/// What devices are known to tell: UTM-30LX and UST, URG-04LX, UXM-30LX, UHG-08LX.
const KNOWN: [Parameters; 4] = [
    parameters([23, 60_000], 1440, [0, 540, 1080], 2400),
    parameters([20, 5_600], 1024, [44, 384, 725], 600),
    parameters([100, 100_000], 1440, [0, 380, 760], 1200),
    parameters([20, 8_000], 1024, [0, 384, 768], 900),
];

/// The device whose scans are most likely asked for so: one that measures just these steps, or else the
/// commonest.
pub(crate) fn of_request(request: &ScanRequest) -> Parameters {
    let steps = [request.first_step, request.last_step];
    let is_whole = |known: &&Parameters| [known.first_step, known.last_step] == steps;
    *KNOWN.iter().find(is_whole).unwrap_or(&KNOWN[0])
}
