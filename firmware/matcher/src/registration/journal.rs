//! What each iteration of an alignment did, for plots: kept for the last scan, in memory of fixed size.
//!
//! Frame: that of the match. Units: meters, radians. While no journal is kept this costs one comparison an
//! iteration.

use biplane_geometry::PortableMath;
use biplane_geometry::{Pose2, wrap_angle};

/// One iteration: where it stood, what spoke against that place, and the step it took.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Iteration {
    /// From 0 for each start: a scan may be aligned from several.
    pub iteration: u32,
    /// The pose before the step.
    pub pose: Pose2,
    /// What is made small, at that pose: for `map` minus the log-likelihood of scan and prior under this
    /// iteration's Cauchy scale, up to a constant; for `gradient` the sum of the end points' distances to
    /// what the references saw, meters.
    pub cost: f64,
    /// Length of the step, meters.
    pub step_m: f64,
    /// The step's turn, radians, never negative.
    pub step_rad: f64,
    /// End points that had a say.
    pub used: u32,
}

/// The iterations of the last scan.
#[derive(Clone, Debug, Default)]
pub struct Journal {
    iterations: Vec<Iteration>,
    dropped: u64,
}

impl Journal {
    /// A journal with memory for so many iterations of one scan; with none, nothing is kept.
    pub(crate) fn with_capacity(iterations: usize) -> Self {
        Self { iterations: Vec::with_capacity(iterations), dropped: 0 }
    }

    /// Whether there is anything to keep for.
    #[inline]
    pub(crate) fn is_kept(&self) -> bool {
        self.iterations.capacity() > 0
    }

    /// A new scan.
    pub(crate) fn begin(&mut self) {
        self.iterations.clear();
    }

    /// An iteration went from one pose to another.
    pub(crate) fn push(&mut self, iteration: u32, [from, to]: [&Pose2; 2], (cost, used): (f64, u32)) {
        if self.iterations.len() == self.iterations.capacity() {
            self.dropped += 1;
            return;
        }
        self.iterations.push(Iteration {
            iteration,
            pose: *from,
            cost,
            step_m: (to.x_m - from.x_m).portable_hypot(to.y_m - from.y_m),
            step_rad: wrap_angle(to.theta_rad - from.theta_rad).abs(),
            used,
        });
    }

    /// The iterations of the last scan, in order.
    #[must_use]
    pub fn iterations(&self) -> &[Iteration] {
        &self.iterations
    }

    /// Iterations of all scans that found no room.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_across_half_a_turn_is_a_small_one_and_a_full_journal_counts_what_it_drops() {
        let mut journal = Journal::with_capacity(1);
        let (from, to) = (Pose2::new(0.0, 1.0, 3.1), Pose2::new(3.0, 5.0, -3.1));
        journal.push(0, [&from, &to], (2.0, 7));
        journal.push(1, [&to, &from], (1.0, 8));
        let [only] = journal.iterations() else { panic!("{journal:?}") };
        assert_eq!((only.iteration, only.pose, only.cost, only.used), (0, from, 2.0, 7));
        assert!((only.step_m - 5.0).abs() < 1e-12 && (only.step_rad - 0.083).abs() < 1e-3, "{only:?}");
        assert_eq!(journal.dropped(), 1);
        journal.begin();
        assert!(journal.iterations().is_empty() && journal.dropped() == 1);
        assert!(!Journal::default().is_kept());
    }
}
