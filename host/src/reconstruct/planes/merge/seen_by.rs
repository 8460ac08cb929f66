//! Which scans saw a plane, and how many of its points each.
//!
//! A pose that errs moves all points of a scan alike. So a step between two planes that the same scans saw is
//! real, and one between planes that were seen one after the other may be none.

use std::collections::BTreeMap;

/// Two planes were seen apart when the scans that saw both saw no more than this share of the smaller one.
/// Larger: posts that hide little of the wall behind them count as seen apart from it. Smaller: the few scans
/// at the border of two sections, which saw both, keep them apart.
const MAX_COMMON_SHARE: f64 = 0.1;

/// How many points of a plane each scan saw.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SeenBy {
    points: BTreeMap<u32, u32>,
}

impl SeenBy {
    /// For each of `planes` labels; `None` where points do not say their scan.
    pub(crate) fn of_labels(labels: &[i32], scans: &[u32], planes: usize) -> Option<Vec<Self>> {
        if labels.len() != scans.len() {
            return None;
        }
        let mut seen = vec![Self::default(); planes];
        for (label, scan) in labels.iter().zip(scans) {
            if let Some(own) = usize::try_from(*label).ok().and_then(|label| seen.get_mut(label)) {
                *own.points.entry(*scan).or_default() += 1;
            }
        }
        Some(seen)
    }

    /// Adds what saw another plane.
    pub(crate) fn join(&mut self, other: &Self) {
        other.points.iter().for_each(|(scan, points)| *self.points.entry(*scan).or_default() += points);
    }

    /// Whether hardly any scan saw both.
    pub(crate) fn is_apart_from(&self, other: &Self) -> bool {
        let all = |seen: &Self| seen.points.values().map(|points| u64::from(*points)).sum::<u64>();
        let in_both = |(scan, points): (&u32, &u32)| {
            other.points.get(scan).map_or(0, |others| u64::from(*points.min(others)))
        };
        let common: u64 = self.points.iter().map(in_both).sum();
        common as f64 <= MAX_COMMON_SHARE * all(self).min(all(other)) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::SeenBy;

    /// Planes 0 and 1, the second one with five points in each of ten scans from `first` on.
    fn apart(first: u32, points_of_both: usize) -> bool {
        let wall = (0..10).flat_map(|scan| vec![(0, scan); 40]);
        let other = (first..first + 10).flat_map(|scan| vec![(1, scan); 5]);
        let last = vec![(0, first + 9); points_of_both];
        let (labels, scans): (Vec<i32>, Vec<u32>) = wall.chain(other).chain(last).unzip();
        let seen = SeenBy::of_labels(&labels, &scans, 2).expect("points know their scans");
        assert_eq!(seen[0].is_apart_from(&seen[1]), seen[1].is_apart_from(&seen[0]));
        seen[0].is_apart_from(&seen[1])
    }

    #[test]
    fn what_the_same_scans_saw_is_not_apart_and_a_scan_at_the_border_is_no_matter() {
        assert!(apart(10, 0) && apart(9, 0));
        assert!(!apart(0, 0) && !apart(8, 0));
        assert!(apart(10, 5) && !apart(9, 5));
    }

    #[test]
    fn points_without_scans_say_nothing() {
        assert_eq!(SeenBy::of_labels(&[0, 1], &[], 2), None);
    }
}
