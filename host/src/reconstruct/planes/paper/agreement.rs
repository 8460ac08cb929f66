//! How far two labelings of the same points agree, whatever numbers their planes have.

use serde::Serialize;
use std::collections::HashMap;

/// Two labelings side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Agreement {
    /// Share of points on which both agree: on planes that belong together, or on none in both; percent.
    pub points_percent: f64,
    /// Planes of the first that belong to one of the second: each has more than half of the points of both
    /// together.
    pub same_planes: usize,
    /// Planes of the first.
    pub planes: usize,
    /// Planes of the second.
    pub other_planes: usize,
}

/// Compares labels of the same points; negative labels are none. Planes belong together pair by pair, largest
/// common part first.
pub(crate) fn agreement(labels: &[i32], others: &[i32]) -> Agreement {
    let mut common: HashMap<(i32, i32), usize> = HashMap::new();
    let (mut sizes, mut other_sizes) = (HashMap::new(), HashMap::new());
    for (label, other) in labels.iter().map(|l| (*l).max(-1)).zip(others.iter().map(|l| (*l).max(-1))) {
        *common.entry((label, other)).or_default() += 1;
        *sizes.entry(label).or_insert(0usize) += 1;
        *other_sizes.entry(other).or_insert(0usize) += 1;
    }
    let mut agreed = common.get(&(-1, -1)).copied().unwrap_or(0);
    let mut pairs: Vec<((i32, i32), usize)> =
        common.into_iter().filter(|((label, other), _)| *label >= 0 && *other >= 0).collect();
    pairs.sort_unstable_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    let (mut used, mut other_used) = (Vec::new(), Vec::new());
    let mut same_planes = 0;
    for ((label, other), count) in pairs {
        if used.contains(&label) || other_used.contains(&other) {
            continue;
        }
        used.push(label);
        other_used.push(other);
        agreed += count;
        let together = sizes[&label] + other_sizes[&other] - count;
        same_planes += usize::from(2 * count > together);
    }
    let planes = |sizes: &HashMap<i32, usize>| sizes.keys().filter(|label| **label >= 0).count();
    Agreement {
        points_percent: 100.0 * agreed as f64 / labels.len().max(1) as f64,
        same_planes,
        planes: planes(&sizes),
        other_planes: planes(&other_sizes),
    }
}

#[cfg(test)]
mod tests {
    use super::{Agreement, agreement};

    #[test]
    fn numbers_do_not_matter_and_what_is_split_counts_once() {
        let labels = [0, 0, 0, 0, 1, 1, 1, -1, -1, 2];
        // Plane 0 is 7 there; 1 is split into 3 and 4; a stray point differs; 2 is on none.
        let others = [7, 7, 7, 7, 3, 3, 4, -1, 7, -1];
        let found = agreement(&labels, &others);
        assert_eq!(found, Agreement { points_percent: 70.0, same_planes: 2, planes: 3, other_planes: 3 });
        assert_eq!(agreement(&labels, &labels).points_percent, 100.0);
        assert_eq!(agreement(&[], &[]).planes, 0);
    }
}
