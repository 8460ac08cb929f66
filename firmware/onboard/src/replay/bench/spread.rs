//! How times are spread: mean, quantiles, largest.

use biplane_geometry::quantile::nearest_rank;
use serde::Serialize;

/// Microseconds a scan.
#[derive(Copy, Clone, PartialEq, Debug, Default, Serialize)]
pub(crate) struct Spread {
    /// The mean.
    pub mean: f64,
    /// Half of all take no longer.
    pub p50: f64,
    /// 99 of 100 take no longer.
    pub p99: f64,
    /// 999 of 1000 take no longer.
    pub p99_9: f64,
    /// The longest.
    pub max: f64,
}

impl Spread {
    /// Of times in nanoseconds, which are sorted on the way; zeros of none.
    pub(crate) fn of_ns(times_ns: &mut [i64]) -> Self {
        times_ns.sort_unstable();
        let us = |ns: i64| ns as f64 * 1e-3;
        let at = |share: f64| nearest_rank(times_ns, share).map_or(0.0, us);
        let mean = us(times_ns.iter().sum()) / times_ns.len().max(1) as f64;
        Self { mean, p50: at(0.5), p99: at(0.99), p99_9: at(0.999), max: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_times_that_were_measured() {
        let mut times_ns: Vec<i64> = (1..=1000).rev().map(|i| i * 1000).collect();
        let spread = Spread::of_ns(&mut times_ns);
        assert_eq!(spread, Spread { mean: 500.5, p50: 500.0, p99: 990.0, p99_9: 999.0, max: 1000.0 });
    }

    #[test]
    fn of_one_time_everything_is_that_time_and_of_none_nothing() {
        assert_eq!(
            Spread::of_ns(&mut [7000]),
            Spread { mean: 7.0, p50: 7.0, p99: 7.0, p99_9: 7.0, max: 7.0 }
        );
        assert_eq!(Spread::of_ns(&mut []), Spread::default());
    }
}
