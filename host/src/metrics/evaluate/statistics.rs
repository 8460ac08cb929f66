//! Figures of a set of errors, each with its definition: the sources of our measures differ in theirs.

use biplane_geometry::quantile::linear;
use serde::Serialize;

/// Mean, spread and largest, as in the tables of the relations metric.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanSpread {
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of a sample (over n - 1); zero of a single value.
    pub std: f64,
    /// The largest.
    pub max: f64,
}

impl MeanSpread {
    /// Of these values; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mean = mean(values)?;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let freedom = (values.len() - 1).max(1) as f64;
        Some(Self { mean, std: (squares / freedom).sqrt(), max: largest(values) })
    }
}

/// The figures of a pose error, as evo prints them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// Root of the mean square.
    pub rmse: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Half of the values are smaller; the mean of the two in the middle of an even number.
    pub median: f64,
    /// Standard deviation of the population (over n).
    pub std: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl ErrorFigures {
    /// Of these values; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mean = mean(values)?;
        let count = values.len() as f64;
        let mean_square = |offset: f64| values.iter().map(|v| (v - offset).powi(2)).sum::<f64>() / count;
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            rmse: mean_square(0.0).sqrt(),
            mean,
            median: linear(&sorted, 0.5)?,
            std: mean_square(mean).sqrt(),
            min: sorted[0],
            max: largest(values),
        })
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::{ErrorFigures, MeanSpread};

    #[test]
    fn the_figures_of_four_values_are_those_counted_by_hand() {
        // Mean 4; squares of the differences 9 + 1 + 1 + 9 = 20; the squares themselves 1 + 9 + 25 + 49 = 84.
        let values = [5.0, 1.0, 7.0, 3.0];
        let spread = MeanSpread::of(&values).unwrap();
        assert_eq!((spread.mean, spread.max), (4.0, 7.0));
        assert!((spread.std - (20.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        let figures = ErrorFigures::of(&values).unwrap();
        assert_eq!((figures.mean, figures.median, figures.min, figures.max), (4.0, 4.0, 1.0, 7.0));
        assert!((figures.std - 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((figures.rmse - 21.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn one_value_has_no_spread_and_none_has_no_figures() {
        assert_eq!(MeanSpread::of(&[2.0]), Some(MeanSpread { mean: 2.0, std: 0.0, max: 2.0 }));
        assert!(MeanSpread::of(&[]).is_none() && ErrorFigures::of(&[]).is_none());
    }
}
