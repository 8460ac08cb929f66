//! What was seen of a common map, sorted by what was seen.

use biplane_matcher::Pose2;
use nalgebra::Vector3;

use crate::slam::pose_covariance::map_motion::about;
use crate::slam::refinement::observations::{Observations, Seen};

/// So many rows are looked at together: half a meter of wall.
const TOGETHER: usize = 10;
/// Rows whose directions differ more belong to other walls: the cosine.
const SAME_DIRECTION: f64 = 0.9;

/// What a node saw of a row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sight {
    /// The node.
    pub node: usize,
    /// 1 / m^2.
    pub weight: f64,
    /// How far off it lies, meters.
    pub offset_m: f64,
}

/// The rows of observations, each with the nodes that saw it.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// How a motion of the map about its origin moves each row: the same for all nodes that saw it.
    vectors: Vec<Vector3<f64>>,
    /// Where each row's nodes begin in `seen`; one more than there are rows.
    starts: Vec<usize>,
    /// By row, nodes ascending.
    seen: Vec<Sight>,
}

impl Rows {
    /// Sorts what nodes at these poses saw.
    pub(super) fn new(observations: &Observations, poses: &[Pose2]) -> Self {
        let mut starts = vec![0; observations.row_count() + 1];
        for node in 0..poses.len() {
            for seen in observations.seen_by(node) {
                starts[seen.row + 1] += 1;
            }
        }
        for row in 1..starts.len() {
            starts[row] += starts[row - 1];
        }
        let mut next = starts.clone();
        let mut vectors = vec![Vector3::zeros(); observations.row_count()];
        let mut seen = vec![Sight::default(); starts.last().copied().unwrap_or(0)];
        for (node, pose) in poses.iter().enumerate() {
            let from_motion = about(pose).transpose();
            for Seen { row, step, weight, offset_m } in observations.seen_by(node) {
                vectors[row] = from_motion * step;
                seen[next[row]] = Sight { node, weight, offset_m };
                next[row] += 1;
            }
        }
        Self { vectors, starts, seen }
    }

    /// The variance of what nodes saw, as a multiple of what its weights say.
    ///
    /// Neighbors on one wall err together, so the residuals of up to [`TOGETHER`] rows that follow each other
    /// are summed up before they are squared. That each row's place is known from its nodes alone is taken
    /// into account.
    pub(super) fn noise_share(&self, observations: &Observations, nodes: usize) -> f64 {
        let (mut squares, mut expected) = (0.0, 0.0);
        let means: Vec<(f64, f64)> =
            self.starts.windows(2).map(|ends| mean(&self.seen[ends[0]..ends[1]])).collect();
        for node in 0..nodes {
            let (mut pull, mut count, mut last) = (0.0, 0, Vector3::zeros());
            for Seen { row, step, weight, offset_m } in observations.seen_by(node) {
                let (mean_m, sum) = means[row];
                if count == TOGETHER || step.xy().dot(&last.xy()) < SAME_DIRECTION {
                    squares += pull * pull;
                    (pull, count) = (0.0, 0);
                }
                pull += weight * (offset_m - mean_m);
                expected += weight * (1.0 - weight / sum);
                (count, last) = (count + 1, step);
            }
            squares += pull * pull;
        }
        if expected > 0.0 { squares / expected } else { 1.0 }
    }

    /// The same with other weights: the variance of what a node saw is `noise` times what its weight says,
    /// and `common_m2` more that no number of beams makes smaller.
    #[must_use]
    pub(super) fn with_errors(mut self, noise: f64, common_m2: f64) -> Self {
        for sight in &mut self.seen {
            sight.weight /= noise + common_m2 * sight.weight;
        }
        self
    }

    /// Each row's vector, and who saw it.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Vector3<f64>, &[Sight])> {
        let seen = self.starts.windows(2).map(|ends| &self.seen[ends[0]..ends[1]]);
        self.vectors.iter().zip(seen).filter(|(_, seen)| !seen.is_empty())
    }
}

/// The mean offset of what was seen, and the sum of the weights.
fn mean(seen: &[Sight]) -> (f64, f64) {
    let sum: f64 = seen.iter().map(|sight| sight.weight).sum();
    let offsets: f64 = seen.iter().map(|sight| sight.weight * sight.offset_m).sum();
    if sum > 0.0 { (offsets / sum, sum) } else { (0.0, 1.0) }
}
