//! The starts: 10 cm off in x and in y, and off in heading.

use biplane_matcher::{Guess, Pose2, wrap_angle};

/// So far off in x and in y, meters.
pub(crate) const SHIFT_M: f64 = 0.1;
/// So far off in heading, degrees.
pub(crate) const HEADINGS_DEG: [f64; 13] =
    [-30.0, -25.0, -20.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0];
/// The corners, x before y.
const CORNERS: [[f64; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];

/// The error of every start, with the index of its heading.
pub(crate) fn starts() -> impl Iterator<Item = (usize, Pose2)> {
    HEADINGS_DEG.into_iter().enumerate().flat_map(|(heading, degrees)| {
        CORNERS
            .into_iter()
            .map(move |[x, y]| (heading, Pose2::new(SHIFT_M * x, SHIFT_M * y, degrees.to_radians())))
    })
}

/// The true pose with a start's error, in the reference's axes.
pub(crate) fn moved(truth: &Pose2, error: &Pose2) -> Pose2 {
    Pose2::new(truth.x_m + error.x_m, truth.y_m + error.y_m, wrap_angle(truth.theta_rad + error.theta_rad))
}

/// What the matcher is told: the start, and how far off a start may be.
pub(crate) fn guess(reference_from_base: Pose2) -> Guess {
    let max_deg = HEADINGS_DEG[HEADINGS_DEG.len() - 1];
    Guess { reference_from_base, half_m: SHIFT_M, half_rad: max_deg.to_radians() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_52_starts_each_10_cm_off_both_ways_and_at_most_30_degrees() {
        let all: Vec<_> = starts().collect();
        assert_eq!(all.len(), 52);
        for (heading, start) in all {
            assert_eq!((start.x_m.abs(), start.y_m.abs()), (0.1, 0.1));
            assert!((start.theta_rad.to_degrees() - HEADINGS_DEG[heading]).abs() < 1e-9);
        }
    }
}
