//! Quantiles, each named by its definition, because for few values they differ. Values come sorted in
//! ascending order.
//!
//! | definition | who uses it, and why |
//! |---|---|
//! | [`nearest_rank`] | times of `bench`, `basin` and the recorder, distances of `compare`: the figure is a value that was measured |
//! | [`linear`] | errors and bands of `evaluate` and `plot`: the figure that other evaluation programs give (NumPy's default) |
//! | [`upper_median`] | spacings, shifts and robust scales: a middle value without an average of two, found in linear time as well |
//! | [`weighted`] | the noise of a cloud, where each value counts as much as the points behind it |

/// How many of `count` values are at most the quantile: the smallest number that is at least the share, and
/// at least 1.
#[cfg(feature = "std")]
#[must_use]
pub fn rank(count: usize, share: f64) -> usize {
    (share * count as f64).ceil().max(1.0) as usize
}

/// The smallest value that at least this share of all do not exceed; `None` of none.
#[cfg(feature = "std")]
#[must_use]
pub fn nearest_rank<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    sorted.get(rank(sorted.len(), share) - 1).or(sorted.last()).copied()
}

/// The value at this share of the way from the first to the last, between neighbors in proportion; `None` of
/// none.
#[cfg(feature = "std")]
#[must_use]
pub fn linear(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (low, part) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(last);
    Some(sorted[low] + part * (sorted[high] - sorted[low]))
}

/// The middle value, of an even count the upper one of both; `None` of none.
#[must_use]
pub fn upper_median<T: Copy>(sorted: &[T]) -> Option<T> {
    sorted.get(sorted.len() / 2).copied()
}

/// The first item at which this share of the whole weight is reached; `None` of none.
pub fn weighted<T>(sorted: &[T], share: f64, weight: impl Fn(&T) -> f64) -> Option<&T> {
    let limit = sorted.iter().map(&weight).sum::<f64>() * share;
    let mut passed = 0.0;
    sorted.iter().find(|item| {
        passed += weight(item);
        passed >= limit
    })
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    const SHARES: [f64; 9] = [0.0, 0.01, 0.25, 0.3, 0.5, 0.75, 0.95, 0.99, 1.0];

    #[test]
    fn a_nearest_rank_is_the_first_value_that_enough_do_not_exceed() {
        for count in 1..60_u32 {
            let values: Vec<u32> = (0..count).map(|k| k / 2 * 3).collect();
            for share in SHARES {
                let enough = |v: &&u32| {
                    values.iter().filter(|other| other <= v).count() as f64 >= share * f64::from(count)
                };
                assert_eq!(
                    nearest_rank(&values, share).as_ref(),
                    values.iter().find(enough),
                    "{count} {share}"
                );
            }
        }
        assert_eq!(nearest_rank::<u32>(&[], 0.5), None);
    }

    #[test]
    fn a_linear_quantile_lies_between_its_neighbors() {
        for (share, expected) in
            [(0.0, 10.0), (0.25, 15.0), (0.3, 16.0), (0.5, 20.0), (0.9, 36.0), (1.0, 40.0)]
        {
            let found = linear(&[10.0, 15.0, 20.0, 30.0, 40.0], share).unwrap();
            assert!((found - expected).abs() < 1e-12, "{share}");
        }
        assert_eq!((linear(&[7.0], 0.3), linear(&[], 0.3)), (Some(7.0), None));
    }

    #[test]
    fn an_upper_median_has_as_many_values_below_as_above_or_one_more() {
        for count in 1..20 {
            let values: Vec<usize> = (0..count).collect();
            let median = upper_median(&values).unwrap();
            assert!(median == count - 1 - median || median == count - median, "{count}");
        }
        assert_eq!(upper_median::<u8>(&[]), None);
    }

    #[test]
    fn a_weight_counts_like_so_many_equal_values() {
        let weights = [3_u8, 1, 4, 1, 5, 9, 2, 6];
        let items: Vec<(usize, f64)> = weights.iter().map(|w| f64::from(*w)).enumerate().collect();
        let repeated: Vec<usize> =
            weights.iter().enumerate().flat_map(|(k, w)| (0..*w).map(move |_| k)).collect();
        for share in SHARES {
            let found = weighted(&items, share, |(_, weight)| *weight).map(|(value, _)| *value);
            assert_eq!(found, nearest_rank(&repeated, share), "{share}");
        }
    }
}
