//! Figures that are printed: counts with precision and recall, errors with median and worst.

use serde::Serialize;

use biplane_geometry::quantile;

/// How many of the true things were found, and how many of those found are true.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Found {
    /// True things that are counted.
    #[serde(rename = "true")]
    pub truth: usize,
    /// Things of the model that are counted.
    pub model: usize,
    /// Pairs of the two.
    pub matched: usize,
    /// Matched over those of the model.
    pub precision: f64,
    /// Matched over the true ones.
    pub recall: f64,
    /// Harmonic mean of the two; 1 when there is nothing to find and nothing was found.
    pub f1: f64,
}

impl Found {
    /// Of three counts.
    pub(crate) fn new(truth: usize, model: usize, matched: usize) -> Self {
        let share = |of: usize| if of > 0 { matched as f64 / of as f64 } else { 1.0 };
        let f1 = if truth + model > 0 { 2.0 * matched as f64 / (truth + model) as f64 } else { 1.0 };
        Self { truth, model, matched, precision: share(model), recall: share(truth), f1 }
    }
}

/// Sizes of errors, all as absolute values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Errors {
    /// How many there are.
    pub count: usize,
    /// The median; none without any.
    pub median: Option<f64>,
    /// The largest.
    pub worst: Option<f64>,
}

impl Errors {
    /// Of differences.
    pub(crate) fn of(differences: impl IntoIterator<Item = f64>) -> Self {
        let mut sizes: Vec<f64> = differences.into_iter().map(f64::abs).filter(|e| e.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        Self { count: sizes.len(), median: quantile::linear(&sizes, 0.5), worst: sizes.last().copied() }
    }
}

/// Pairs things by score, the best pair first, each thing once: (first, second) in the order of the first.
pub(crate) fn pair_best(scores: impl Iterator<Item = (usize, usize, f64)>) -> Vec<(usize, usize)> {
    let mut scores: Vec<(usize, usize, f64)> = scores.collect();
    scores.sort_by(|a, b| b.2.total_cmp(&a.2).then((a.0, a.1).cmp(&(b.0, b.1))));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (a, b, _) in scores {
        if pairs.iter().all(|pair| pair.0 != a && pair.1 != b) {
            pairs.push((a, b));
        }
    }
    pairs.sort_unstable();
    pairs
}
