//! Median and 90 % band of values in order, over a window that runs along them.

use biplane_geometry::quantile::linear;

/// Ends of the band: 90 % of the values of a window lie between them.
const BAND: [f64; 2] = [0.05, 0.95];

/// Median and band of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    /// Half of the values are smaller.
    pub median: f64,
    /// 5 % are smaller than the first, 5 % larger than the second.
    pub band: [f64; 2],
}

/// Of these values; `None` of none. Values that are not finite are left out.
pub(crate) fn spread(values: impl Iterator<Item = f64>) -> Option<Spread> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let [low, high] = BAND.map(|share| linear(&sorted, share));
    Some(Spread { median: linear(&sorted, 0.5)?, band: [low?, high?] })
}

/// Median and band of `window` points (x, y) at a time, at no more than `most` places, as x of the middle one
/// and spread of y. The points must be in the order of x; at the ends the window is cut.
pub(crate) fn running(points: &[[f64; 2]], window: usize, maximum: usize) -> Vec<(f64, Spread)> {
    let places = points.len().min(maximum);
    let middle = |place: usize| place * (points.len() - 1) / (places.max(2) - 1);
    let at = |place: usize| {
        let middle = middle(place);
        let around = middle.saturating_sub(window / 2)..(middle + window / 2 + 1).min(points.len());
        Some((points[middle][0], spread(points[around].iter().map(|point| point[1]))?))
    };
    (0..places).filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::{running, spread};

    #[test]
    fn ninety_of_a_hundred_and_one_values_lie_in_the_band() {
        let spread = spread((0..=100).rev().map(f64::from).chain([f64::NAN])).unwrap();
        assert_eq!((spread.median, spread.band), (50.0, [5.0, 95.0]));
        assert_eq!(super::spread(std::iter::empty()), None);
    }

    #[test]
    fn the_window_runs_from_the_first_point_to_the_last() {
        let points: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i), f64::from(10 * i)]).collect();
        let found: Vec<[f64; 2]> =
            running(&points, 3, 5).iter().map(|(x, spread)| [*x, spread.median]).collect();
        // At the ends the window holds two points.
        assert_eq!(found, [[0.0, 5.0], [2.0, 20.0], [4.0, 40.0], [6.0, 60.0], [8.0, 75.0]]);
        assert_eq!(running(&points[..1], 3, 5).len(), 1);
        assert!(running(&[], 3, 5).is_empty());
    }
}
