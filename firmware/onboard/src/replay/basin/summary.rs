//! What all starts come to: shares of success, and what an alignment costs.

use biplane_geometry::quantile::nearest_rank;
use serde::Serialize;

use crate::replay::basin::starts::HEADINGS_DEG;
use crate::replay::basin::trial::{Basin, Trial};

/// Within this of the truth a start has succeeded: meters and radians.
const SUCCESS: [f64; 2] = [0.02, 0.5 * std::f64::consts::PI / 180.0];
/// Beyond one of these it has ended somewhere else altogether: meters and radians.
const GROSS: [f64; 2] = [0.1, 2.0 * std::f64::consts::PI / 180.0];

/// Shares of a set of starts, percent.
#[derive(Copy, Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Shares {
    /// Starts.
    pub starts: usize,
    /// Within 2 cm and 0.5 degrees of the truth.
    pub success_percent: f64,
    /// More than 10 cm or 2 degrees wrong.
    pub gross_percent: f64,
    /// Within 2 cm and 0.5 degrees of where the method ends when it starts from the truth.
    pub own_optimum_percent: f64,
}

/// The starts of one heading.
#[derive(Copy, Clone, PartialEq, Debug, Serialize)]
pub(crate) struct AtHeading {
    /// So far off, degrees.
    pub heading_deg: f64,
    /// What became of them.
    #[serde(flatten)]
    pub shares: Shares,
}

/// The whole measurement.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Summary {
    /// The method's name.
    pub matcher: String,
    /// Pairs measured.
    pub pairs: usize,
    /// Pairs of them with a stamp that several scans bear: those that lie best on one another at the true
    /// pose were taken.
    pub ambiguous_pairs: usize,
    /// All starts.
    pub all: Shares,
    /// The starts of the pairs whose stamps name one scan each.
    pub unambiguous: Shares,
    /// By the error of the start's heading.
    pub by_heading: Vec<AtHeading>,
    /// Iterations, median.
    pub iterations_median: f64,
    /// Iterations, 99th percentile.
    pub iterations_p99: f64,
    /// Processor time of an alignment (end points, search, iterations), microseconds, median.
    pub cpu_us_median: f64,
    /// The same, 99th percentile.
    pub cpu_us_p99: f64,
    /// The same with the preparation of the reference, microseconds, median.
    pub cpu_with_preparation_us_median: f64,
    /// Preparation of a reference, microseconds, median.
    pub prepare_us_median: f64,
    /// All alignments' time by all their iterations, microseconds.
    pub iteration_us: f64,
}

impl Summary {
    /// Sums up.
    #[must_use]
    pub(crate) fn new(matcher: &str, basin: &Basin) -> Self {
        let trials = &basin.trials;
        let clear = |trial: &&Trial| !basin.ambiguous[trial.pair];
        let at = |heading: usize| AtHeading {
            heading_deg: HEADINGS_DEG[heading],
            shares: shares(trials.iter().filter(|trial| trial.heading == heading)),
        };
        let iterations = sorted(trials.iter().map(|trial| f64::from(trial.iterations)));
        let cpu_us = sorted(trials.iter().map(|trial| us(trial.cpu_ns)));
        let with_us = sorted(trials.iter().map(|trial| us(trial.cpu_ns + basin.prepare_ns[trial.pair])));
        Self {
            matcher: matcher.to_owned(),
            pairs: basin.pairs.len(),
            ambiguous_pairs: basin.ambiguous.iter().filter(|is_ambiguous| **is_ambiguous).count(),
            all: shares(trials.iter()),
            unambiguous: shares(trials.iter().filter(clear)),
            by_heading: (0..HEADINGS_DEG.len()).map(at).collect(),
            iterations_median: quantile(&iterations, 0.5),
            iterations_p99: quantile(&iterations, 0.99),
            cpu_us_median: quantile(&cpu_us, 0.5),
            cpu_us_p99: quantile(&cpu_us, 0.99),
            cpu_with_preparation_us_median: quantile(&with_us, 0.5),
            prepare_us_median: quantile(&sorted(basin.prepare_ns.iter().map(|ns| us(*ns))), 0.5),
            iteration_us: cpu_us.iter().sum::<f64>() / iterations.iter().sum::<f64>().max(1.0),
        }
    }
}

fn shares<'a>(trials: impl Iterator<Item = &'a Trial>) -> Shares {
    let (mut starts, mut success, mut gross, mut own) = (0, 0, 0, 0);
    for trial in trials {
        starts += 1;
        success += usize::from(within([trial.error_m, trial.error_rad], SUCCESS));
        gross += usize::from(!within([trial.error_m, trial.error_rad], GROSS));
        own += usize::from(within([trial.own_error_m, trial.own_error_rad], SUCCESS));
    }
    let percent = |count: usize| 100.0 * count as f64 / starts.max(1) as f64;
    Shares {
        starts,
        success_percent: percent(success),
        gross_percent: percent(gross),
        own_optimum_percent: percent(own),
    }
}

fn within(error: [f64; 2], limit: [f64; 2]) -> bool {
    error[0] <= limit[0] && error[1] <= limit[1]
}

fn us(ns: i64) -> f64 {
    ns as f64 * 1e-3
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The value that this share of the sorted values do not exceed; zero of none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    nearest_rank(sorted, share).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_matcher::Pose2;

    fn trial(pair: usize, error_m: f64, error_deg: f64) -> Trial {
        Trial {
            pair,
            heading: 6,
            start: Pose2::IDENTITY,
            error_m,
            error_rad: error_deg.to_radians(),
            own_error_m: 0.0,
            own_error_rad: 0.0,
            iterations: 10,
            cpu_ns: 100_000,
        }
    }

    #[test]
    fn shares_are_those_of_the_limits_and_a_pair_with_a_choice_of_scans_is_kept_apart() {
        // By hand: 2 of 5 succeed, 2 are gross (one by heading alone), one is neither; the second pair had a
        // choice.
        let trials = vec![
            trial(0, 0.019, 0.4),
            trial(0, 0.001, 0.6),
            trial(0, 0.0, 2.1),
            trial(1, 0.01, 0.0),
            trial(1, 0.11, 0.0),
        ];
        let basin =
            Basin { pairs: Vec::new(), ambiguous: vec![false, true], prepare_ns: vec![200_000; 2], trials };
        let summary = Summary::new("map", &basin);
        let percents = |shares: Shares| [shares.success_percent, shares.gross_percent];
        assert_eq!(percents(summary.all), [40.0, 40.0]);
        assert_eq!(summary.unambiguous.starts, 3);
        assert!((summary.unambiguous.success_percent - 100.0 / 3.0).abs() < 1e-9);
        assert_eq!(percents(summary.by_heading[6].shares), [40.0, 40.0]);
        assert_eq!(summary.by_heading[0].shares.starts, 0);
        assert_eq!((summary.cpu_us_median, summary.cpu_with_preparation_us_median), (100.0, 300.0));
        assert_eq!((summary.iteration_us, summary.ambiguous_pairs), (10.0, 1));
    }

    #[test]
    fn a_quantile_is_the_value_at_its_place() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        assert_eq!((quantile(&values, 0.5), quantile(&values, 0.99), quantile(&[], 0.5)), (50.0, 99.0, 0.0));
    }
}
