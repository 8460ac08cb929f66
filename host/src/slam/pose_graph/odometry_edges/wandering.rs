//! Where recorded poses wander to and fro while the wheels count a steady way.
//!
//! Along a hedge no beam ends where the one before it did, and a scan fits as well a little ahead or behind.
//! Then recorded steps scatter about those of known wheels, by more than these err, and the speed that they
//! tell changes from step to step, while that of the wheels does not. Odometry that slips, stalls or jumps is
//! what changes itself, or is off by the same again and again. Steps that wander are weighed against the
//! wheels by how much they scatter. Units: meters, radians; steps in the last base's frame.

use biplane_matcher::Pose2;
use nalgebra::{Matrix2, Vector2};

use super::{Chain, Laid, Step, information, recorded_sigma};
use crate::slam::pose_graph::wheel_calibration::WheelCalibration;

/// So many steps on either side tell whether a step wanders.
const ASIDE: usize = 4;
/// Recorded steps that wander scatter by more than so many standard deviations of known wheels.
const SCATTER: f64 = 3.0;
/// So many of them are off by more than that. Fewer: where wheels spin once the recorded way would follow.
const MANY: usize = 3;
/// Their speed changes more than so many times as much as that of the wheels, squared.
const LESS_STEADY: f64 = 2.0;

/// A step, as it was recorded and as known wheels have it.
#[derive(Clone, Copy, Debug)]
struct Both {
    recorded: Pose2,
    counted: Pose2,
    /// Standard deviation of the counted way.
    sigma_m: f64,
    /// So many scans long.
    scans: f64,
}

impl Chain<'_> {
    /// The step where the recorded ones about it wander; `None` where they do not.
    pub(super) fn if_wandering(
        &self,
        all: &[Laid],
        laid: &Laid,
        wheels: Option<&WheelCalibration>,
    ) -> Option<Step> {
        let (wheels, index) = (wheels?, laid.at - 1);
        let near = all.get(index.checked_sub(ASIDE)?..=index + ASIDE)?;
        let both: Option<Vec<Both>> = near.iter().map(|laid| self.both(laid, wheels)).collect();
        weighed(&both?, &recorded_sigma(&laid.recorded, self.params))
    }

    fn both(&self, laid: &Laid, wheels: &WheelCalibration) -> Option<Both> {
        if laid.is_break || laid.unstalled.is_some() {
            return None;
        }
        let (counted, [sigma_m, ..]) = wheels.of(&laid.odometry?);
        let scans = (self.nodes[laid.at].scan - self.nodes[laid.at - 1].scan) as f64;
        Some(Both { recorded: laid.recorded, counted, sigma_m, scans })
    }
}

/// The middle one of some steps, weighed against the wheels, if the recorded ones wander; `drift` is what
/// errs in each recorded step beside that, standard deviations.
fn weighed(both: &[Both], drift: &[f64; 3]) -> Option<Step> {
    let Both { recorded, counted, sigma_m, .. } = both[both.len() / 2];
    let (scatter, of_wheels) = (scatter(both), Matrix2::identity() * sigma_m * sigma_m);
    let is_wide = scatter.symmetric_eigenvalues().max() > (SCATTER * sigma_m).powi(2);
    if !is_wide || !are_many_off(both) || !are_less_steady(both) {
        return None;
    }
    let [x_m, y_m, _] = counted.step_from(&recorded);
    let share = scatter * (scatter + of_wheels).try_inverse()?;
    let [x_m, y_m] = (share * Vector2::new(x_m, y_m)).into();
    let covariance = share * of_wheels + Matrix2::identity() * drift[0] * drift[0];
    let mut known = information(drift);
    known.fixed_view_mut::<2, 2>(0, 0).copy_from(&covariance.cholesky()?.inverse());
    Some((recorded.stepped([x_m, y_m, 0.0]), known))
}

/// How far a recorded step is from the counted one.
fn off(both: &Both) -> Vector2<f64> {
    let [x_m, y_m, _] = both.recorded.step_from(&both.counted);
    Vector2::new(x_m, y_m)
}

/// Whether many of the recorded steps are off by something else than is usual among them.
fn are_many_off(both: &[Both]) -> bool {
    let usual = [0, 1].map(|axis| {
        let mut all: Vec<f64> = both.iter().map(|both| off(both)[axis]).collect();
        all.sort_unstable_by(f64::total_cmp);
        all[all.len() / 2]
    });
    let is_off = |both: &&Both| (off(both) - Vector2::from(usual)).norm() > SCATTER * both.sigma_m;
    both.iter().filter(is_off).count() >= MANY
}

/// How recorded steps scatter about the counted ones: covariance, whatever they are off by in the mean.
fn scatter(both: &[Both]) -> Matrix2<f64> {
    let mean = both.iter().map(off).sum::<Vector2<f64>>() / both.len() as f64;
    let square = |both: &Both| (off(both) - mean) * (off(both) - mean).transpose();
    both.iter().map(square).sum::<Matrix2<f64>>() / (both.len() - 1) as f64
}

/// Whether the speed of the recorded steps changes more than that of the wheels.
fn are_less_steady(both: &[Both]) -> bool {
    let changes = |step: fn(&Both) -> Pose2| -> f64 {
        let speed = |both: &Both| Vector2::new(step(both).x_m, step(both).y_m) / both.scans.max(1.0);
        both.windows(2).map(|pair| (speed(&pair[1]) - speed(&pair[0])).norm_squared()).sum()
    };
    changes(|both| both.recorded) > LESS_STEADY * changes(|both| both.counted)
}

#[cfg(test)]
mod tests {
    use biplane_matcher::Kind;

    use super::*;
    use crate::slam::pose_graph::odometry_edges::tests::{IN_ROOM, STEP_M, drive, point};
    use crate::slam::pose_graph::odometry_edges::{ChainParams, edges};

    /// A number between -1 and 1 that looks random.
    fn noise(of: usize) -> f64 {
        (of * 7919 % 1009) as f64 / 504.5 - 1.0
    }

    /// What comes of the middle one of steps with these lengths, recorded and counted.
    fn middle(lengths_m: impl Fn(usize) -> [f64; 2]) -> Option<Step> {
        let both = |at: usize| {
            let [recorded, counted] = lengths_m(at).map(|x_m| Pose2::new(x_m, 0.0, 0.0));
            Both { recorded, counted, sigma_m: 0.01, scans: 10.0 }
        };
        let both: Vec<Both> = (0..=2 * ASIDE).map(both).collect();
        weighed(&both, &[0.01, 0.01, 0.003])
    }

    #[test]
    fn steps_that_wander_follow_the_wheels_and_are_known_as_these_are() {
        let (step, known) = middle(|at| [0.3 + 0.2 * noise(at + 3), 0.3]).unwrap();
        assert!((step.x_m - 0.3).abs() < 0.01, "{step:?}");
        let sigma = [0, 1, 2].map(|axis| 1.0 / known[(axis, axis)].sqrt());
        assert!(
            (sigma[0] / 0.01_f64.hypot(0.01) - 1.0).abs() < 0.02,
            "as wheels, and what drifts: {sigma:?}"
        );
        assert!((sigma[1] / 0.01 - 1.0).abs() < 1e-6, "across nothing wanders: {sigma:?}");
        assert!((sigma[2] / 0.003 - 1.0).abs() < 1e-6, "{sigma:?}");
    }

    #[test]
    fn odometry_that_is_off_in_any_other_way_says_nothing() {
        assert_eq!(middle(|at| [0.3, 0.3 + 0.2 * noise(at)]), None, "it is what wanders");
        assert_eq!(middle(|at| [0.3, if at == 4 { 1.3 } else { 0.3 }]), None, "it jumps");
        assert_eq!(middle(|at| [0.3, if at < 4 { 0.3 } else { 0.0 }]), None, "it stalls");
        assert_eq!(middle(|_| [0.3, 0.2]), None, "it slips");
        assert_eq!(middle(|at| [if at == 4 { 0.0 } else { 0.3 }, 0.3]), None, "it spins once");
        assert_eq!(middle(|at| [0.1 * at as f64, 0.1 * at as f64]), None, "nothing is off");
        assert_eq!(middle(|at| [0.3 + 0.02 * noise(at), 0.3]), None, "no more than wheels are");
    }

    /// What is seen along a hedge: each beam ends in it somewhere else each time.
    fn hedge(number: usize) -> Vec<biplane_matcher::EndPoint> {
        let leaf = |at: usize| [0.1 * at as f64 - 3.0, -3.0 + 0.12 * noise(61 * number + at)];
        (0..60).map(|at| point(leaf(at), [0.0; 2], Kind::Point)).collect()
    }

    #[test]
    fn along_a_hedge_the_way_is_what_wheels_count_calibrated_elsewhere() {
        let mut nodes = drive();
        for (number, node) in nodes.iter_mut().enumerate().skip(IN_ROOM) {
            node.keyframe_scan.points = hedge(number);
            node.recorded = node.recorded * Pose2::new(0.08 * noise(number * number), 0.0, 0.0);
        }
        let (edges, _) = edges(&nodes, 0, &ChainParams::default());
        let along = &edges[IN_ROOM + ASIDE..edges.len() - ASIDE];
        assert!(along.len() > 5);
        for edge in along {
            assert!((edge.measured.x_m - STEP_M).abs() < 0.01, "{edge:?}");
        }
    }
}
