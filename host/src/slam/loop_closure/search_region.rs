//! Where a submap is looked for in another one: around a guess, as far as the graph is in doubt.

use biplane_matcher::{Pose2, Strip, Window};
use nalgebra::Matrix3;

/// Where a search looks, seen from the submap that it looks in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchRegion {
    /// Where the other submap is expected.
    pub guess: Pose2,
    /// How far around it is looked.
    pub window: Window,
    /// What of the window is looked at; `None`: all of it.
    pub strip: Option<Strip>,
    /// How widely the place was searched before, meters: a guess that comes from a loop found in a wide
    /// window is as doubtful as that.
    pub uncertainty_m: f64,
}

impl SearchRegion {
    /// A whole window.
    pub fn square(guess: Pose2, window: Window, uncertainty_m: f64) -> Self {
        Self { guess, window, strip: None, uncertainty_m }
    }
}

/// The direction of the plane in which the position's part of a covariance or of its inverse is smallest, and
/// how large it is there.
pub(crate) fn smallest(of_pose: &Matrix3<f64>) -> ([f64; 2], f64) {
    let position = of_pose.fixed_view::<2, 2>(0, 0).symmetric_eigen();
    let smallest = position.eigenvalues.imin();
    let direction = position.eigenvectors.column(smallest);
    ([direction[0], direction[1]], position.eigenvalues[smallest].max(0.0))
}

#[cfg(test)]
mod tests {
    use super::smallest;
    use nalgebra::Matrix3;

    #[test]
    fn the_smallest_direction_of_a_turned_ellipse_is_its_short_axis() {
        let (sin, cos) = 0.3_f64.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let covariance = turn * Matrix3::from_diagonal(&[9.0, 0.25, 0.1].into()) * turn.transpose();
        let (across, variance_m2) = smallest(&covariance);
        assert!((variance_m2 - 0.25).abs() < 1e-9, "{variance_m2}");
        assert!((across[0] * -sin + across[1] * cos).abs() > 1.0 - 1e-9, "{across:?}");
    }
}
