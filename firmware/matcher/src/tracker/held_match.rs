//! A match that leads away from odometry and inertia, against the one that keeps to them.
//!
//! Along a corridor with people a scan may fit best where the people are: beside the base, or a step behind.
//! Odometry that has been right so far and inertia then say the same, and the scan hardly fits worse where
//! both lead. Such a match has to explain clearly more than the one that is held along its way. Odometry that
//! errs again and again by the same is believed no longer. Frame: map. Units: meters; likelihoods are natural
//! logarithms.

use nalgebra::Vector3;

use biplane_geometry::Pose2;

use crate::motion::Step;
use crate::motion::steadiness::Steadiness;
use crate::registration::gauss_newton::Alignment;
use crate::registration::gauss_newton::prior::{CAUCHY_SCALE, Prior, cauchy};
use crate::tracker::step_choice::FAULT;

/// A match leads away when it is more standard deviations than this from where the odometry leads.
const AWAY: f64 = 3.0;
/// Inertia agrees with the odometry when it is closer to it than to the match by this factor, squared.
const CLOSER: f64 = 4.0;
/// How far a held match may be from where it is held, a standard deviation, meters.
const HELD_M: f64 = 0.002;
/// Offsets from the odometry closer than this are the same, meters.
const SAME_M: f64 = 0.03;
/// A match with the same offset so many times in a row is believed.
const TIMES: u32 = 3;

/// Where a match leads, and where the base is expected.
pub(crate) struct Way<'a> {
    /// The match.
    pub found: &'a Alignment,
    /// Where the odometry leads.
    pub prior: &'a Prior,
    /// The odometry's step.
    pub step: &'a Step,
    /// Where inertia leads.
    pub again: Pose2,
    /// How much the motion changes from scan to scan.
    pub steadiness: &'a Steadiness,
}

/// A match that is to be held along a direction.
pub(crate) struct Held {
    direction: Vector3<f64>,
    /// What speaks against the odometry being wrong by so much.
    against: f64,
}

/// The matches so far that led away.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldMatches {
    last_offset: Option<Pose2>,
    times: u32,
}

impl HeldMatches {
    /// How a match is to be held; `None` when it does not lead away, when inertia agrees with it, or when
    /// others before led to the same place.
    pub(crate) fn consider(&mut self, way: &Way) -> Option<Held> {
        let (found, mean) = (way.found.pose, way.prior.mean);
        let (x_m, y_m) = (found.x_m - mean.x_m, found.y_m - mean.y_m);
        let way_m = (x_m * x_m + y_m * y_m).sqrt();
        if way_m <= 0.0 {
            return None;
        }
        let offset = mean.between(&found);
        let is_same = self.last_offset.is_some_and(|last| last.between(&offset).distance_m() < SAME_M);
        self.times = if is_same { self.times + 1 } else { 1 };
        self.last_offset = Some(offset);
        let sigmas = way_m / way.step.sigma[0];
        if sigmas <= AWAY || self.times >= TIMES {
            *self = Self::default();
            return None;
        }
        let off = |pose: &Pose2| way.steadiness.squared(&way.again.between(pose));
        (off(&found) > CLOSER * off(&mean)).then(|| Held {
            direction: Vector3::new(x_m / way_m, y_m / way_m, 0.0),
            against: cauchy(sigmas * sigmas, CAUCHY_SCALE).min(FAULT),
        })
    }
}

impl Held {
    /// What is expected of the pose when it is held.
    pub(crate) fn prior(&self, prior: &Prior) -> Prior {
        let held = self.direction * self.direction.transpose() / (HELD_M * HELD_M);
        Prior { information: prior.information + held, gives_way: false, ..*prior }
    }

    /// The held match when the one that was found does not explain clearly more. It says nothing along the
    /// direction in which it was held.
    pub(crate) fn preferred(&self, mut held: Alignment, found: &Alignment) -> Option<Alignment> {
        if found.gain() - held.gain() >= self.against {
            return None;
        }
        let known = held.information * self.direction;
        let along = self.direction.dot(&known);
        if along > 0.0 {
            held.information -= known * known.transpose() / along;
        }
        Some(held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::odometry::Odometry;
    use crate::registration::gauss_newton::fit::Fit;
    use nalgebra::Matrix3;

    fn alignment(x_m: f64, explained: f64) -> Alignment {
        let fit = Fit { explained, informative: explained, total: 180.0, ..Fit::default() };
        let information = Matrix3::from_diagonal(&Vector3::new(1e4, 1e5, 1e6));
        Alignment { pose: Pose2::new(x_m, 0.0, 0.0), information, fit, iterations: 1, at_rest: true }
    }

    /// Odometry and inertia lead to 0.15 m, by two centimeters; the match leads elsewhere.
    fn consider(matches: &mut HeldMatches, found_m: f64, again_m: f64) -> Option<Held> {
        let mean = Pose2::new(0.15, 0.0, 0.0);
        let step = Step { last_from_base: mean, sigma: [0.02, 0.02, 0.01], odometry: Odometry::Used };
        let information = Matrix3::from_diagonal(&Vector3::new(2500.0, 2500.0, 1e4));
        matches.consider(&Way {
            found: &alignment(found_m, 150.0),
            prior: &Prior { mean, information, measured: true, gives_way: true },
            step: &step,
            again: Pose2::new(again_m, 0.0, 0.0),
            steadiness: &Steadiness::after(Some(0.2)),
        })
    }

    #[test]
    fn a_match_that_leads_away_is_held_unless_inertia_agrees_with_it() {
        let held = |found_m, again_m| consider(&mut HeldMatches::default(), found_m, again_m).is_some();
        assert!(held(0.01, 0.15), "a step behind");
        assert!(!held(0.10, 0.15), "within the noise");
        assert!(!held(0.01, 0.02), "inertia says so too");
    }

    #[test]
    fn what_the_odometry_is_off_by_again_and_again_is_believed() {
        let mut matches = HeldMatches::default();
        assert!([0.01, 0.02].iter().all(|found_m| consider(&mut matches, *found_m, 0.15).is_some()));
        assert!(consider(&mut matches, 0.01, 0.15).is_none());
        assert!(consider(&mut matches, 0.01, 0.15).is_some(), "it begins anew");
    }

    #[test]
    fn a_held_match_gives_way_to_one_that_explains_clearly_more_and_says_nothing_along() {
        let held = consider(&mut HeldMatches::default(), 0.01, 0.15).unwrap();
        let (alike, worse) = (alignment(0.15, 149.0), alignment(0.15, 120.0));
        assert!(held.preferred(worse, &alignment(0.01, 150.0)).is_none());
        let kept = held.preferred(alike, &alignment(0.01, 150.0)).unwrap();
        assert!(kept.information[(0, 0)].abs() < 1e-6 && kept.information[(1, 1)] > 9e4);
    }
}
