//! Which of the loops found are believed.
//!
//! Those that stand by themselves or by others are weighed against the steps and each other. Those that may
//! hold the next door come last, and only near the place where the first ones have them. Otherwise a whole
//! corridor of them, each of which counts by itself, outweighs the few that know the place.

use super::candidate::{INLIER_WEIGHT, LoopCloser, Weighed};
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::graduated_non_convexity;

impl LoopCloser<'_> {
    /// Which loops are believed now, and the poses that they make.
    pub(crate) fn select_inliers(&mut self) {
        if self.weighed.count == self.loops.len() {
            return; // with nothing new the same ones are chosen
        }
        self.weighed.count = self.loops.len();
        let edges = self.edges();
        let supported = self.supported(&edges);
        let chosen: Vec<usize> = (0..edges.len()).filter(|&at| supported[at] && !self.refused[at]).collect();
        let loops: Vec<Edge> = chosen.iter().map(|&at| edges[at]).collect();
        let weights = graduated_non_convexity::optimize(&mut self.poses, self.chain, &loops);
        self.inlier = vec![false; edges.len()];
        for (&at, weight) in chosen.iter().zip(weights) {
            self.inlier[at] = weight > INLIER_WEIGHT;
        }
    }

    /// Whether loops are weighed from here on that may hold the next door; whether others are believed then.
    pub(crate) fn weigh_ambiguous(&mut self, weighs: bool) -> bool {
        if self.weighed.with_ambiguous == weighs {
            return false;
        }
        let before = std::mem::take(&mut self.inlier);
        self.weighed = Weighed { count: 0, with_ambiguous: weighs };
        self.select_inliers();
        self.settled.fill(false);
        self.inlier != before
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidate::LoopCloser;
    use super::super::params::CandidateParams;
    use super::super::perceptual_aliasing::tests::{add_loops, alike, twice};
    use super::super::verification::RefineParams;
    use crate::slam::pose_graph::tests::chained;

    /// From so far a place is looked for, meters.
    const AFAR_M: f64 = 20.0;

    /// Loops of the first submaps of a corridor that is driven along twice, found so far ahead of where the
    /// steps have them, with so many points each that tell the place: how many are believed before and after
    /// those are weighed that may hold the next door.
    fn inlier_counts(loops: usize, ahead_m: f64, along_points: usize) -> [usize; 2] {
        let (submaps, count, chain) = twice(&alike(4.0), 0.0, 0.4);
        let recording_of = vec![0; submaps.len()];
        let params = (CandidateParams::default(), RefineParams::default());
        let mut closer = LoopCloser::new(&submaps, &recording_of, &chain, chained(&chain), params);
        add_loops(&mut closer, (count, loops), ahead_m, AFAR_M);
        closer.loops.iter_mut().for_each(|added| added.found.agreement.along_points = along_points);
        closer.select_inliers();
        let at_first = closer.inlier_count();
        closer.weigh_ambiguous(true);
        [at_first, closer.inlier_count()]
    }

    #[test]
    fn where_corridors_cross_a_few_places_with_much_to_tell_them_by_are_enough() {
        assert_eq!(inlier_counts(3, 8.0, 200), [3, 3]);
        assert_eq!(inlier_counts(3, 8.0, 30), [0, 0]);
        assert_eq!(inlier_counts(1, 8.0, 200), [0, 0]);
    }

    #[test]
    fn a_passage_that_may_be_the_next_one_comes_last_and_only_where_the_others_have_it() {
        assert_eq!(inlier_counts(7, 0.0, 30), [0, 7]);
        assert_eq!(inlier_counts(7, 4.0, 30), [0, 0]);
        assert_eq!(inlier_counts(7, 4.0, 200), [7, 7], "it tells its place");
    }
}
