//! Odometry against inertia: which of two steps a base made, by the scan that it saw after it.
//!
//! Frame: map. Units: meters, radians; likelihoods are natural logarithms.

use nalgebra::Matrix3;

use crate::motion::steadiness::Steadiness;
use crate::motion::{Prediction, Step};
use crate::registration::covariance::weakest_sigma_m;
use crate::registration::gauss_newton::Alignment;
use crate::registration::gauss_newton::params::WEAK_M;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::verdict::Verdict;
use biplane_geometry::Pose2;

/// What speaks against the odometry being wrong in one step.
pub(crate) const FAULT: f64 = 12.0;
/// The same once scans have contradicted it.
const FAULT_AGAIN: f64 = 3.0;
/// A rival is taken when it is likelier by more than this: one end point that fits by chance is no reason.
const CLEARLY: f64 = 1.0;
/// A pose so many times closer to where one step leads than to where the other does confirms that step.
const CLOSER: f64 = 2.0;

/// A step, and where the base is when it made it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Expectation {
    /// The step.
    pub step: Step,
    /// Of the pose after it, against the map around.
    pub covariance: Matrix3<f64>,
    /// The pose after it, as a prior.
    pub prior: Prior,
}

/// What was found from an expectation.
pub(crate) type Finding = (Alignment, Verdict);

/// Two expectations, one of them the odometry's, and how they are to be weighed.
pub(crate) struct StepChoice<'a> {
    odometry: &'a Expectation,
    inertia: &'a Expectation,
    steadiness: &'a Steadiness,
    /// The most that speaks against the odometry being wrong.
    fault: f64,
    /// The most that speaks against a sudden motion.
    sudden: f64,
}

impl<'a> StepChoice<'a> {
    /// Of the likeliest step and its rival, of which one is the odometry's.
    pub(crate) fn new(
        likeliest: &'a Expectation,
        rival: &'a Expectation,
        prediction: &'a Prediction,
    ) -> Self {
        let (odometry, inertia, fault) = if likeliest.step.measured() {
            (likeliest, rival, FAULT)
        } else {
            (rival, likeliest, FAULT_AGAIN)
        };
        let sudden = prediction.odds_against_leap.map_or(f64::INFINITY, |odds| (fault + odds).max(0.0));
        Self { odometry, inertia, steadiness: &prediction.steadiness, fault, sudden }
    }

    /// Whether the rival's finding is to be taken instead of the likeliest step's.
    pub(crate) fn is_won_by(&self, rival: &Finding, likeliest: &Finding) -> bool {
        rival.1 == Verdict::Found
            && (likeliest.1 != Verdict::Found
                || self.likelihood(&rival.0) > self.likelihood(&likeliest.0) + CLEARLY)
    }

    /// By the scan, by what odometry and inertia expect, and by the odds of a fault and of a leap.
    fn likelihood(&self, alignment: &Alignment) -> f64 {
        let sudden = self.steadiness.neg_log_likelihood(&self.inertia.prior.mean.between(&alignment.pose));
        alignment.gain()
            - self.odometry.prior.neg_log_likelihood(&alignment.pose).min(self.fault)
            - sudden.min(self.sudden)
    }

    /// How far the odometry leaps, squared, and whether the scan alone shows that the base did so too; `None`
    /// where it does not tell.
    pub(crate) fn leap(&self, findings: [&Finding; 2]) -> Option<(f64, bool)> {
        let [(first, _), (second, _)] = findings;
        let is_same = self.steadiness.squared(&first.pose.between(&second.pose)) <= 1.0;
        if !is_same && (first.gain() - second.gain()).abs() <= CLEARLY {
            return None;
        }
        let (best, verdict) = if first.gain() >= second.gain() { findings[0] } else { findings[1] };
        if *verdict != Verdict::Found || weakest_sigma_m(&best.information) > WEAK_M {
            return None;
        }
        let from = |pose: &Pose2, to: &Pose2| self.steadiness.squared(&pose.between(to));
        let (odometry, inertia) = (&self.odometry.prior.mean, &self.inertia.prior.mean);
        let (off_odometry, off_inertia) = (from(odometry, &best.pose), from(inertia, &best.pose));
        let is_closer = |this: f64, other: f64| CLOSER * CLOSER * this < other;
        (is_closer(off_odometry, off_inertia) || is_closer(off_inertia, off_odometry))
            .then(|| (from(odometry, inertia), off_odometry < off_inertia))
    }
}

/// Whether a match that contradicts the odometry is to be believed. Where a scan explains too few end points
/// to outweigh a fault of the odometry, it has to gain more by the match than the odometry loses by it: more
/// than it explained where the odometry leads, of which `unmoved` is the score. A dozen end points on the
/// jambs of a door fit in many places.
pub(crate) fn is_worth_its_contradiction(
    alignment: &Alignment,
    prior: &Prior,
    unmoved: impl FnOnce() -> f64,
) -> bool {
    if !prior.is_contradicted_by(&alignment.pose) || alignment.gain() >= FAULT {
        return true;
    }
    let gained = alignment.gain() * (1.0 - unmoved() / alignment.fit.score());
    gained >= prior.neg_log_likelihood(&alignment.pose).min(FAULT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::odometry::Odometry;
    use crate::registration::gauss_newton::fit::Fit;
    use nalgebra::Vector3;

    fn expectation(x_m: f64, odometry: Odometry) -> Expectation {
        let step = Step { last_from_base: Pose2::new(x_m, 0.0, 0.0), sigma: [0.1; 3], odometry };
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-4));
        let information = Matrix3::from_diagonal(&Vector3::new(1e4, 1e4, 1e4));
        let prior = Prior { mean: step.last_from_base, information, measured: true, gives_way: true };
        Expectation { step, covariance, prior }
    }

    /// A pose so far ahead that explains so many end points, in every direction or not.
    fn found(x_m: f64, explained: f64, is_sure: bool) -> Finding {
        let along = if is_sure { 1e4 } else { 1.0 };
        let alignment = Alignment {
            pose: Pose2::new(x_m, 0.0, 0.0),
            information: Matrix3::from_diagonal(&Vector3::new(along, 1e4, 1e6)),
            fit: Fit { explained, informative: 360.0, total: 360.0, ..Fit::default() },
            iterations: 1,
            at_rest: true,
        };
        (alignment, Verdict::Found)
    }

    /// With odometry that leaps by a meter, inertia that says 10 cm, and these odds against such a leap.
    fn with_choice<T>(odds_against_leap: Option<f64>, ask: impl Fn(&StepChoice) -> T) -> T {
        let (odometry, inertia) = (expectation(1.0, Odometry::Used), expectation(0.1, Odometry::Missing));
        let (steadiness, rival) = (Steadiness::after(Some(0.2)), Some(inertia.step));
        let prediction = Prediction { step: odometry.step, rival, steadiness, odds_against_leap };
        ask(&StepChoice::new(&odometry, &inertia, &prediction))
    }

    fn inertia_wins(odds_against_leap: Option<f64>, findings: [Finding; 2]) -> bool {
        with_choice(odds_against_leap, |choice| choice.is_won_by(&findings[1], &findings[0]))
    }

    #[test]
    fn where_the_scan_does_not_tell_a_leap_is_believed_when_most_were_made_and_not_when_few_were() {
        let alike = [found(1.0, 300.0, true), found(0.1, 300.0, true)];
        let wins = [Some(-3.0), Some(0.0), Some(3.0), None].map(|odds| inertia_wins(odds, alike));
        assert_eq!(wins, [false, false, true, true]);
    }

    #[test]
    fn where_nothing_is_known_of_leaps_the_scan_decides() {
        assert!(inertia_wins(Some(0.0), [found(1.0, 290.0, true), found(0.1, 300.0, true)]));
        assert!(!inertia_wins(Some(0.0), [found(1.0, 300.0, true), found(0.1, 290.0, true)]));
        let lost = (found(1.0, 300.0, true).0, Verdict::Lost);
        assert!(inertia_wins(Some(-9.0), [lost, found(0.1, 200.0, true)]));
    }

    #[test]
    fn a_scan_shows_a_leap_when_it_fits_clearly_better_at_one_end_and_in_every_direction() {
        let shown = |first: Finding, second: Finding| {
            with_choice(None, |choice| choice.leap([&first, &second]).map(|(_, was_made)| was_made))
        };
        assert_eq!(shown(found(1.0, 300.0, true), found(0.1, 200.0, true)), Some(true));
        assert_eq!(shown(found(1.0, 200.0, true), found(0.1, 300.0, true)), Some(false));
        assert_eq!(shown(found(0.1, 300.0, true), found(0.1, 300.0, true)), Some(false), "both came there");
        assert_eq!(shown(found(1.0, 300.0, true), found(0.1, 300.0, true)), None, "alike");
        assert_eq!(shown(found(1.0, 300.0, false), found(0.1, 200.0, true)), None, "a bare corridor");
        assert_eq!(shown(found(0.6, 300.0, true), found(0.6, 300.0, true)), None, "in between");
    }

    #[test]
    fn few_end_points_do_not_contradict_the_odometry_and_many_do() {
        let information = Matrix3::from_diagonal(&Vector3::new(0.02_f64.powi(-2), 0.02_f64.powi(-2), 1e4));
        let prior = Prior { mean: Pose2::IDENTITY, information, measured: true, gives_way: true };
        let worth = |x_m: f64, end_points: f64, unmoved: f64| {
            let fit =
                Fit { explained: end_points, informative: end_points, total: end_points, ..Fit::default() };
            let pose = Pose2::new(x_m, 0.0, 0.0);
            let alignment = Alignment { pose, information, fit, iterations: 1, at_rest: true };
            is_worth_its_contradiction(&alignment, &prior, || unmoved)
        };
        // 20 cm off, ten standard deviations: what explains 14 end points hardly better is chance. A whole
        // scan is not, nor is anything less than that off.
        assert_eq!([worth(0.2, 14.0, 0.9), worth(0.2, 180.0, 0.9)], [false, true]);
        assert_eq!([worth(0.1, 18.0, 0.2), worth(0.1, 18.0, 0.5)], [true, false]);
        // Within the noise of the odometry every match is.
        assert!(worth(0.06, 14.0, 0.9));
    }
}
