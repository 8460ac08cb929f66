//! What a scan only seems to know.
//!
//! The directions of mapped walls are off by some `nu`, so that J^T W J of the distances to them holds nu^2 T
//! too much, T being the same sum over the walls' tangents: even a bare corridor shows some information along
//! its axis, and a round room about its center. In the coordinates in which T is the identity, nu^2 is taken
//! off each eigenvalue, down to zero, and off the gradient in proportion; where nothing is left the odometry
//! decides. Coordinates: x, y (m), theta (rad).

use nalgebra::{Cholesky, Const, Matrix3, Vector3};

use crate::registration::covariance::weakest_direction;

/// A motion is a turn when turning moves end points by more than this of what it moves the base, squared:
/// about a center within two arms of it. Along a corridor it is what noise leaves.
const TURNS: f64 = 0.25;

/// What is to be believed of an information matrix.
#[derive(Clone, Debug)]
pub(crate) struct Degeneracy {
    share: Share,
    /// The motion of which nothing is believed.
    weak: Option<Weak>,
}

/// A motion that a scan hardly sees: along a direction of the plane, with the turn that goes with it. Along a
/// corridor that is next to none, in a round room the turn about its center.
#[derive(Clone, Debug)]
struct Weak {
    /// The motion.
    motion: Vector3<f64>,
    /// What a gradient loses for what it says of the motion, so that it says nothing.
    lost: Vector3<f64>,
}

impl Weak {
    /// The motion of an information that begins with a direction of the plane; turns count by the end points'
    /// mean squared distance.
    fn new(information: &Matrix3<f64>, [x, y]: [f64; 2], arm_m2: f64) -> Self {
        let turn = -(information[(0, 2)] * x + information[(1, 2)] * y) / information[(2, 2)];
        let is_turn = turn * turn * arm_m2 > TURNS;
        let motion = Vector3::new(x, y, if is_turn { turn } else { 0.0 });
        let lost = motion.component_mul(&Vector3::new(1.0, 1.0, arm_m2));
        let length = motion.dot(&lost);
        Self { motion, lost: lost / length }
    }
}

#[derive(Clone, Debug)]
enum Share {
    /// Every direction is known better than it is doubted: nothing has to be taken apart.
    Everywhere {
        /// The information that is believed.
        information: Matrix3<f64>,
        /// The walls' information across them, factored.
        across: Cholesky<f64, Const<3>>,
        /// What is taken off: nu^2 times the sum over the tangents.
        discounted: Matrix3<f64>,
    },
    /// Some direction is not known; taken apart along the directions in which walls' directions matter.
    Remapped {
        /// From whitened coordinates back; its columns are the directions.
        axes: Matrix3<f64>,
        /// Into whitened coordinates.
        whiten: Matrix3<f64>,
        /// Information along each direction, whitened.
        values: Vector3<f64>,
        /// The share of it that is believed, 0 to 1.
        trusted: Vector3<f64>,
    },
}

impl Degeneracy {
    /// From the walls' information `across` them, the same sum `along` their tangents, and the directions'
    /// error. Where less than `least` (1 / m^2) is left in a direction of the plane, nothing of it is
    /// believed: what noise and grid leave of a bare corridor's axis is the same scan after scan, and would
    /// carry the pose away from the odometry.
    pub(crate) fn new(across: &Matrix3<f64>, along: &Matrix3<f64>, nu_rad: f64, minimum: f64) -> Self {
        let share = Share::new(across, along, nu_rad);
        let information = share.information();
        let weak = weakest_direction(&information).filter(|(known, _)| *known < minimum);
        // Both sums together have a row and its normal for each end point: its arm in turns, squared.
        let arm_m2 =
            || (across[(2, 2)] + along[(2, 2)]) / (across[(0, 0)] + across[(1, 1)]).max(f64::MIN_POSITIVE);
        Self { share, weak: weak.map(|(_, direction)| Weak::new(&information, direction, arm_m2())) }
    }

    /// The information that is believed.
    pub(crate) fn information(&self) -> Matrix3<f64> {
        let information = self.share.information();
        self.sure(&self.sure(&information).transpose())
    }

    /// The part that is believed of a share of the walls' information.
    pub(crate) fn trusted(&self, information: &Matrix3<f64>) -> Matrix3<f64> {
        let columns = [0, 1, 2].map(|column| self.share.gradient(&information.column(column).into_owned()));
        self.sure(&Matrix3::from_columns(&columns))
    }

    /// The part of a gradient that is believed.
    pub(crate) fn gradient(&self, gradient: &Vector3<f64>) -> Vector3<f64> {
        let trusted = self.share.gradient(gradient);
        match &self.weak {
            Some(weak) => trusted - weak.lost * weak.motion.dot(&trusted),
            None => trusted,
        }
    }

    /// Without the motion of which nothing is believed.
    fn sure(&self, matrix: &Matrix3<f64>) -> Matrix3<f64> {
        match &self.weak {
            Some(weak) => matrix - weak.lost * (weak.motion.transpose() * matrix),
            None => *matrix,
        }
    }
}

impl Share {
    fn new(across: &Matrix3<f64>, along: &Matrix3<f64>, nu_rad: f64) -> Self {
        let scale = along.trace().max(across.trace()) + f64::MIN_POSITIVE;
        let tangents = along + Matrix3::identity() * (1e-6 * scale);
        let discounted = tangents * (nu_rad * nu_rad);
        let information = across - discounted;
        // Positive means that no eigenvalue is as small as nu^2: then the sums below need no eigenvalues.
        match (information.cholesky(), across.cholesky()) {
            (Some(_), Some(across)) => Self::Everywhere { information, across, discounted },
            _ => Self::remapped(across, &tangents, nu_rad * nu_rad),
        }
    }

    fn remapped(across: &Matrix3<f64>, tangents: &Matrix3<f64>, squared: f64) -> Self {
        let factor = tangents.cholesky().map_or_else(Matrix3::identity, |factors| factors.l());
        let unfactor = factor.try_inverse().unwrap_or_else(Matrix3::identity);
        let eigen = (unfactor * across * unfactor.transpose()).symmetric_eigen();
        Self::Remapped {
            axes: factor * eigen.eigenvectors,
            whiten: eigen.eigenvectors.transpose() * unfactor,
            values: eigen.eigenvalues,
            trusted: eigen
                .eigenvalues
                .map(|value| if value > squared { (value - squared) / value } else { 0.0 }),
        }
    }

    fn information(&self) -> Matrix3<f64> {
        match self {
            Self::Everywhere { information, .. } => *information,
            Self::Remapped { axes, values, trusted, .. } => {
                let kept = Matrix3::from_diagonal(&trusted.component_mul(values));
                axes * kept * axes.transpose()
            }
        }
    }

    fn gradient(&self, gradient: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Everywhere { across, discounted, .. } => gradient - discounted * across.solve(gradient),
            Self::Remapped { axes, whiten, trusted, .. } => {
                axes * trusted.component_mul(&(whiten * gradient))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walls along x at y = +-1, seen at x = -3 .. 3, each `nu` off in direction, alternately to either side.
    fn corridor(nu: f64) -> (Matrix3<f64>, Matrix3<f64>) {
        let (mut across, mut along) = (Matrix3::zeros(), Matrix3::zeros());
        for i in -30..=30 {
            for side in [-1.0, 1.0] {
                let arm = [0.1 * f64::from(i), side];
                let tilt = if i % 2 == 0 { nu } else { -nu };
                let n = [tilt, (1.0 - tilt * tilt).sqrt()];
                let row = Vector3::new(n[0], n[1], arm[0] * n[1] - arm[1] * n[0]);
                across += row * row.transpose();
                let row = Vector3::new(-n[1], n[0], arm[0] * n[0] + arm[1] * n[1]);
                along += row * row.transpose();
            }
        }
        (across, along)
    }

    #[test]
    fn what_tilted_walls_say_of_a_corridors_axis_is_not_believed() {
        let (across, along) = corridor(0.05);
        assert!(across[(0, 0)] > 0.1, "the walls seem to say something: {across}");
        let kept = Degeneracy::new(&across, &along, 0.06, 0.0).information();
        assert!(kept[(0, 0)].abs() < 1e-6 * across[(1, 1)], "{kept}");
        assert!((kept[(1, 1)] / across[(1, 1)] - 1.0).abs() < 0.01, "{kept}");
    }

    #[test]
    fn a_gradient_along_the_axis_vanishes_and_one_across_stays() {
        let (across, along) = corridor(0.05);
        let degeneracy = Degeneracy::new(&across, &along, 0.06, 0.0);
        assert!(degeneracy.gradient(&Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-3);
        assert!(
            (degeneracy.gradient(&Vector3::new(0.0, 1.0, 0.0)) - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-2
        );
    }

    #[test]
    fn without_error_everything_is_trusted() {
        let (across, along) = corridor(0.05);
        let kept = Degeneracy::new(&across, &along, 0.0, 0.0).information();
        assert!((kept - across).norm() < 1e-9 * across.norm(), "{kept}");
    }

    #[test]
    fn a_direction_that_is_known_less_than_asked_for_is_left_to_others_and_the_rest_stays() {
        let (mut across, along) = corridor(0.0);
        across[(0, 0)] += 40.0;
        let [all, sure] = [39.0, 41.0].map(|minimum| Degeneracy::new(&across, &along, 0.0, minimum));
        assert!((all.information() - across).norm() < 1e-9 * across.norm());
        let kept = sure.information();
        assert!(kept.row(0).norm() < 1e-9 && (kept[(2, 2)] - across[(2, 2)]).abs() < 1e-6, "{kept}");
        assert!((sure.trusted(&across) - kept).norm() < 1e-9 * across.norm());
        let gradient = sure.gradient(&Vector3::new(3.0, 2.0, 1.0));
        assert!((gradient - Vector3::new(0.0, 2.0, 1.0)).norm() < 1e-9, "{gradient}");
    }

    #[test]
    fn in_a_round_room_the_turn_about_its_center_is_left_to_others() {
        let (mut across, mut along) = (Matrix3::zeros(), Matrix3::zeros());
        for i in -80..=80 {
            let (y, x) = f64::from(i).to_radians().sin_cos();
            let arm = [2.0 + 3.0 * x, 3.0 * y];
            let tilt = if i % 2 == 0 { 0.05 } else { -0.05 };
            let n = [x - tilt * y, y + tilt * x];
            let row = Vector3::new(n[0], n[1], arm[0] * n[1] - arm[1] * n[0]);
            across += row * row.transpose();
            let row = Vector3::new(-n[1], n[0], arm[0] * n[0] + arm[1] * n[1]);
            along += row * row.transpose();
        }
        let about_center = Vector3::new(0.0, -2.0, 1.0);
        let known = Degeneracy::new(&across, &along, 0.05, 10.0);
        let kept = known.information();
        assert!((kept * about_center).norm() < 1e-3 * across.norm(), "{kept}");
        // How far the wall is stays known.
        assert!(kept[(0, 0)] > 0.9 * across[(0, 0)], "{kept}");
        let gradient = known.gradient(&Vector3::new(0.0, 1.0, 3.0));
        assert!(gradient.dot(&about_center).abs() < 0.01, "{gradient}");
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        let kept = Degeneracy::new(&Matrix3::zeros(), &Matrix3::zeros(), 0.05, 0.0).information();
        assert!(kept.norm() < 1e-100, "{kept}");
    }

    #[test]
    fn with_structure_both_ways_taking_apart_changes_nothing() {
        let (mut across, along) = corridor(0.05);
        across[(0, 0)] += 40.0; // a wall at the corridor's end
        let (nu, gradient) = (0.05, Vector3::new(0.3, -0.2, 0.1));
        let whole = Share::new(&across, &along, nu);
        assert!(matches!(whole, Share::Everywhere { .. }));
        let scale = along.trace().max(across.trace());
        let remapped = Share::remapped(&across, &(along + Matrix3::identity() * (1e-6 * scale)), nu * nu);
        assert!((whole.information() - remapped.information()).norm() < 1e-9 * across.norm());
        assert!((whole.gradient(&gradient) - remapped.gradient(&gradient)).norm() < 1e-9);
    }
}
