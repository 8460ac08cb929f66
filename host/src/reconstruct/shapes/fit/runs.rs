//! Runs of points along an axis: stretches without a long gap. Meters.

/// A gap along the axis that is longer ends the surface.
const MAX_GAP_M: f64 = 0.45;
/// Points of a bin are of one run.
const BIN_M: f64 = 0.4;
/// Most bins; what is longer is sorted.
const MAX_BINS: f64 = 4096.0;

/// The part of the axis along which there are points without a long gap, with the greatest number of them.
pub(crate) fn longest_run(along_m: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = along_m.collect();
    let run = longest_of(&all).unwrap_or_else(|| longest_of_sorted(&mut all));
    all.retain(|along| (run.low_m..=run.high_m).contains(along));
    // The outermost hundredth are outliers.
    let cut = all.len() / 200;
    if cut == 0 {
        return (!all.is_empty()).then_some([run.low_m, run.high_m]);
    }
    let high = all.len() - 1 - cut;
    let high_m = *all.select_nth_unstable_by(high, f64::total_cmp).1;
    let low_m = *all[..high].select_nth_unstable_by(cut, f64::total_cmp).1;
    Some([low_m, high_m])
}

/// A stretch with points.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    low_m: f64,
    high_m: f64,
    count: usize,
}

impl Run {
    const NONE: Self = Self { low_m: f64::INFINITY, high_m: f64::NEG_INFINITY, count: 0 };

    fn add(&mut self, other: &Self) {
        self.low_m = self.low_m.min(other.low_m);
        self.high_m = self.high_m.max(other.high_m);
        self.count += other.count;
    }

    /// The first of those with the greatest number of points.
    fn better(self, other: Self) -> Self {
        if other.count > self.count { other } else { self }
    }
}

/// The longest run, by bins so narrow that no gap is within one; `None` when they were too many.
fn longest_of(all: &[f64]) -> Option<Run> {
    let point = |along: &f64| Run { low_m: *along, high_m: *along, count: 1 };
    let mut whole = Run::NONE;
    all.iter().for_each(|along| whole.add(&point(along)));
    let count = (whole.high_m - whole.low_m) / BIN_M;
    // All that is not finite too.
    if !(0.0..MAX_BINS).contains(&count) {
        return None;
    }
    let mut bins = vec![Run::NONE; count as usize + 1];
    for along in all {
        bins[((along - whole.low_m) / BIN_M) as usize].add(&point(along));
    }
    let (mut best, mut run) = (Run::NONE, Run::NONE);
    for bin in bins.iter().filter(|bin| bin.count > 0) {
        if bin.low_m - run.high_m > MAX_GAP_M {
            best = best.better(run);
            run = *bin;
        } else {
            run.add(bin);
        }
    }
    Some(best.better(run))
}

/// The same by sorting.
fn longest_of_sorted(all: &mut [f64]) -> Run {
    all.sort_unstable_by(f64::total_cmp);
    let runs = all.chunk_by(|a, b| b - a <= MAX_GAP_M);
    runs.map(|run| Run { low_m: run[0], high_m: run[run.len() - 1], count: run.len() })
        .fold(Run::NONE, Run::better)
}

#[cfg(test)]
mod tests {
    use super::{longest_of, longest_of_sorted, longest_run};
    use crate::reconstruct::planes::paper::random::Random;

    #[test]
    fn bins_find_the_run_that_sorting_finds() {
        let mut random = Random::new(8);
        for _ in 0..200 {
            let mut along: Vec<f64> = (0..60).map(|_| 12.0 * random.unit()).collect();
            let by_bins = longest_of(&along).unwrap();
            assert_eq!(by_bins, longest_of_sorted(&mut along));
        }
    }

    #[test]
    fn a_hundredth_is_cut_off_and_a_gap_ends_the_run() {
        let along = (0..1000).map(|k| 0.01 * f64::from((k * 617) % 1000));
        let [low_m, high_m] = longest_run(along.chain([10.6, 11.0])).unwrap();
        assert!((low_m - 0.05).abs() < 1e-9 && (high_m - 9.94).abs() < 1e-9, "{low_m} {high_m}");
        assert_eq!(longest_run([f64::MAX, 1.0, 1.2].into_iter()), Some([1.0, 1.2]));
        assert_eq!(longest_run(std::iter::empty()), None);
    }
}
