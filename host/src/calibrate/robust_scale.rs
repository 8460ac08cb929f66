//! What wheels that slip and observations that belong to something else must not decide: a scale that half of
//! all may be wrong in, and Tukey's weight.

/// Tukey's constant, in standard deviations.
const TUKEY: f64 = 4.685;

/// The standard deviation of values by the median of their sizes, which must not be empty.
pub(super) fn scale(mut sizes: Vec<f64>) -> f64 {
    let middle = sizes.len() / 2;
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// What a value that is off by so many standard deviations counts.
pub(super) fn weight(deviations: f64) -> f64 {
    let share = deviations / TUKEY;
    let kept = (1.0 - share * share).max(0.0);
    kept * kept
}
