//! How well two scans lie on one another at a given pose: plain nearest neighbors, nothing of the matcher.

use biplane_geometry::PortableMath;
use biplane_matcher::{Pose2, Scan};

/// A farther neighbor counts as this far, meters: what one scan sees and the other does not.
const CUTOFF_M: f64 = 0.2;
/// Longer ranges are left out, meters.
const RANGE_MAX_M: f32 = 40.0;

/// The end points of a scan in the base's frame, meters.
pub(crate) fn end_points(scan: &Scan) -> Vec<[f64; 2]> {
    let hits = scan.beams.iter().filter(|beam| beam.range_m < RANGE_MAX_M);
    hits.map(|beam| scan.end_in_base_m(beam, f64::from(beam.range_m))).collect()
}

/// Mean distance from the second scan's end points to the nearest of the first's, meters.
pub(crate) fn gap_m(first: &[[f64; 2]], second: &[[f64; 2]], first_from_second: &Pose2) -> f64 {
    let nearest_m = |point: &[f64; 2]| {
        let [x, y] = first_from_second.transform(*point);
        first.iter().map(|other| (other[0] - x).portable_hypot(other[1] - y)).fold(CUTOFF_M, f64::min)
    };
    second.iter().map(nearest_m).sum::<f64>() / second.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_lie_on_one_another_at_the_true_pose_and_not_beside_it() {
        let second = [[1.0, 0.0], [1.0, 1.0]];
        let truth = Pose2::new(0.5, 0.0, std::f64::consts::FRAC_PI_2);
        let first = second.map(|point| truth.transform(point));
        assert!(gap_m(&first, &second, &truth) < 1e-12);
        let beside = Pose2::new(0.55, 0.0, std::f64::consts::FRAC_PI_2);
        assert!((gap_m(&first, &second, &beside) - 0.05).abs() < 1e-12);
        assert!((gap_m(&first, &second, &Pose2::new(9.0, 0.0, 0.0)) - 0.2).abs() < 1e-12);
    }
}
