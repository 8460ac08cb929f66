//! Numbers in text files.

use std::fmt;

/// A number with four decimals, which are tenths of a millimeter where it is a length, and never minus zero.
pub(crate) struct Number(pub(crate) f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = (self.0 * 1e4).round() / 1e4;
        write!(f, "{:.4}", if rounded == 0.0 { 0.0 } else { rounded })
    }
}

#[cfg(test)]
mod tests {
    use super::Number;

    #[test]
    fn four_decimals_are_written_and_no_minus_before_zero() {
        let written = [-0.00001, 2.0, -1.23456].map(|value| Number(value).to_string());
        assert_eq!(written, ["0.0000", "2.0000", "-1.2346"]);
    }
}
