//! Round numbers along an axis.

use biplane_geometry::PortableMath;

/// The distance between ticks of a linear axis with at most `most` of them: 1, 2 or 5 times a power of ten.
fn step(span: f64, maximum: usize) -> f64 {
    let minimum = span / maximum.max(1) as f64;
    let power = 10_f64.portable_powf(minimum.portable_log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= minimum * 0.999)
        .unwrap_or(10.0 * power)
}

/// A range that ends at ticks, around `[low, high]`.
pub(crate) fn rounded_range([low, high]: [f64; 2], maximum: usize) -> [f64; 2] {
    if low >= high {
        return [low - 0.5, low + 0.5];
    }
    let step = step(high - low, maximum);
    [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step]
}

/// Ticks of a linear axis with their words, some `most` intervals between them at most.
pub(crate) fn linear([low, high]: [f64; 2], maximum: usize) -> Vec<(f64, String)> {
    let step = step(high - low, maximum);
    let decimals = (-step.portable_log10().floor()).max(0.0) as usize;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last)
        .map(|count| count as f64 * step)
        .map(|value| (value, format!("{value:.decimals$}")))
        .collect()
}

/// The powers of ten around a range of positive numbers.
pub(crate) fn decades([low, high]: [f64; 2]) -> [f64; 2] {
    let (low, high) = ((low.portable_log10() + 1e-9).floor(), (high.portable_log10() - 1e-9).ceil());
    [10_f64.portable_powf(low), 10_f64.portable_powf(high.max(low + 1.0))]
}

/// Ticks of a logarithmic axis that ends at powers of ten: these powers, with their words.
pub(crate) fn logarithmic([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let (low, high) = (low.portable_log10().round() as i32, high.portable_log10().round() as i32);
    let every = ((high - low) / 6 + 1) as usize;
    let words = |power: i32| match power {
        -3..=4 => format!("{:.*}", (-power).max(0) as usize, 10_f64.powi(power)),
        _ => format!("1e{power}"),
    };
    (low..=high).step_by(every).map(|power| (10_f64.powi(power), words(power))).collect()
}

#[cfg(test)]
mod tests {
    use super::{decades, linear, logarithmic, rounded_range};

    fn words(ticks: &[(f64, String)]) -> Vec<&str> {
        ticks.iter().map(|(_, words)| words.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_have_the_decimals_that_they_need() {
        assert_eq!(words(&linear([0.0, 30.0], 8)), ["0", "5", "10", "15", "20", "25", "30"]);
        assert_eq!(words(&linear([0.0, 1.0], 8)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(
            words(&linear([-0.03, 0.03], 8)),
            ["-0.03", "-0.02", "-0.01", "0.00", "0.01", "0.02", "0.03"]
        );
        assert_eq!(rounded_range([0.0, 43.2], 8), [0.0, 50.0]);
        assert_eq!(rounded_range([0.0, 100.0], 8), [0.0, 100.0]);
        assert_eq!(words(&linear([0.0, 30.0], 4)), ["0", "10", "20", "30"]);
        assert_eq!(rounded_range([0.0, 31.0], 4), [0.0, 40.0]);
        assert_eq!(rounded_range([3.0, 3.0], 8), [2.5, 3.5]);
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        assert_eq!(decades([0.02, 7.0]), [0.01, 10.0]);
        assert_eq!(decades([1.0, 1.0]), [1.0, 10.0]);
        assert_eq!(words(&logarithmic([0.01, 100.0])), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(words(&logarithmic([1e-9, 1e-3])), ["1e-9", "1e-7", "1e-5", "0.001"]);
    }
}
