//! What holds whatever beams say: walls are upright, and the robot starts level where it starts.

use crate::slam::refinement::spatial::knots::State;
use crate::slam::refinement::spatial::normal_equations::rows::Rows;
use crate::slam::refinement::spatial::normal_equations::{KERNEL, Layout, robust};
use crate::slam::refinement::spatial::surfaces::Surface;

/// Walls within this of upright are upright, as the sine.
const NEAR_UPRIGHT: f64 = 0.14;
/// How the first knot is held: position, heading; the robot stands level at the start.
const START_M: f64 = 1e-3;
const START_RAD: f64 = 1e-3;
const LEVEL_RAD: f64 = 9e-4;

/// Walls are upright.
pub(crate) fn upright(planes: &[Surface], layout: Layout, sigma_rad: f64, rows: &mut Rows) {
    for (number, plane) in planes.iter().enumerate().filter(|(_, plane)| !plane.is_line) {
        let leans = plane.normal[2];
        if leans.abs() < NEAR_UPRIGHT {
            let part = (layout.plane(number), [plane.tangents[0][2], plane.tangents[1][2], 0.0]);
            rows.push(&[part], leans, robust(leans, KERNEL * sigma_rad) / (sigma_rad * sigma_rad));
        }
    }
}

/// The first knot stays, and stands level.
pub(crate) fn start(layout: Layout, state: &State, anchor: &State, rows: &mut Rows) {
    let flat = [(0, START_M), (1, START_M), (5, START_RAD)];
    let tilt = [(2, START_M), (3, LEVEL_RAD), (4, LEVEL_RAD)];
    for (variable, parts) in [(layout.flat(0), flat), (layout.tilt(0), tilt)] {
        for (axis, (part, sigma)) in parts.into_iter().enumerate() {
            let direction = std::array::from_fn(|at| f64::from(u8::from(at == axis)));
            let residual = state[part] - anchor[part];
            rows.push(&[(variable, direction)], residual, sigma.powi(-2));
        }
    }
}
