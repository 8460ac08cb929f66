//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each stretch; a place found so is believed only when two more,
//! of other stretches, agree with it over the ways that both recordings drove between them.

use biplane_matcher::Pose2;

use super::candidate::{Closing, Pair};
use super::checkpoint::Checkpoint;
use super::graph::Edge;
use super::search::Window;

/// Which recordings came together: for each the number of the first one that it is joined to (itself when it is alone).
pub fn groups(recordings: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Vec<usize> {
    let mut group: Vec<usize> = (0..recordings).collect();
    for [one, other] in pairs {
        let (low, high) = (group[one].min(group[other]), group[one].max(group[other]));
        for entry in &mut group {
            if *entry == high {
                *entry = low;
            }
        }
    }
    group
}

impl Closing<'_> {
    /// Which recordings the believed loops join.
    pub fn groups(&self, recordings: usize) -> Vec<usize> {
        let believed = self.loops.iter().zip(&self.believed).filter(|(_, believed)| **believed);
        groups(
            recordings,
            believed.map(|(found, _)| found.stretches.map(|stretch| self.recording_of[stretch])),
        )
    }

    /// Where nothing is known of two recordings: every second stretch of one against every second one of the other, all around.
    /// Whether any came together.
    pub fn join(
        &mut self,
        recordings: usize,
        checkpoint: &mut Checkpoint,
        progress: &mut dyn FnMut(usize, usize),
    ) -> bool {
        let groups = self.groups(recordings);
        let group_of = |stretch: usize| groups[self.recording_of[stretch]];
        let window = Window { half_m: self.params.near_m, half_rad: std::f64::consts::PI };
        let mut pairs = Vec::new();
        for query in (0..self.submaps.len()).step_by(2) {
            for other in (0..query).step_by(2) {
                if group_of(query) != group_of(other) && !self.tried.contains_key(&[other, query]) {
                    pairs.push(Pair {
                        stretches: [other, query],
                        guess: Pose2::IDENTITY,
                        window,
                        doubt_m: f64::INFINITY,
                    });
                }
            }
        }
        self.search(&pairs, checkpoint, progress);
        self.seek_company(checkpoint, progress);
        let edges = self.edges();
        let company = self.company(&edges);
        let apart = |edge: &Edge| group_of(edge.from) != group_of(edge.to);
        let joins = |at: &usize| {
            apart(&edges[*at])
                && company[*at].len() >= 2
                && self.refine.tells(&self.loops[*at].found.agreement)
        };
        let best = (0..edges.len()).filter(joins).max_by(|&a, &b| {
            (company[a].len(), self.loops[a].found.agreement.share)
                .partial_cmp(&(company[b].len(), self.loops[b].found.agreement.share))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(best) = best else { return false };
        let edge = edges[best];
        let moved = self.poses[edge.from] * edge.measured * self.poses[edge.to].inverse();
        let joining = group_of(edge.to);
        for (stretch, pose) in self.poses.iter_mut().enumerate() {
            if groups[self.recording_of[stretch]] == joining {
                *pose = moved * *pose;
            }
        }
        self.believe();
        self.groups(recordings) != groups
    }
}

#[cfg(test)]
mod tests {
    use super::groups;

    #[test]
    fn recordings_come_together_over_others() {
        assert_eq!(groups(5, [[1, 3], [4, 3]].into_iter()), [0, 1, 2, 1, 1]);
        assert_eq!(groups(3, [].into_iter()), [0, 1, 2]);
        assert_eq!(groups(3, [[2, 1], [1, 0]].into_iter()), [0, 0, 0]);
    }
}
