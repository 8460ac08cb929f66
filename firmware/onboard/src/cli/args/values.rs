//! Words of the command line as values.

use std::time::Duration;

/// A length of time: `90`, `90s`, `1.5m`, `2h`, `500ms`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let error = || format!("expected a length of time such as 60s, 1.5m or 2h, found \"{text}\"");
    let number_end = text.find(|letter: char| letter.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(number_end);
    let factor = match unit {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(error()),
    };
    let seconds: f64 = number.trim().parse().map_err(|_| error())?;
    if seconds.is_nan() || seconds <= 0.0 {
        return Err(error());
    }
    Duration::try_from_secs_f64(seconds * factor).map_err(|_| error())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_time_have_the_usual_units() {
        let table = [("90", 90_000), ("60s", 60_000), ("1.5m", 90_000), ("2h", 7_200_000), ("500ms", 500)];
        for (text, ms) in table {
            assert_eq!(duration(text), Ok(Duration::from_millis(ms)), "{text}");
        }
        for text in ["", "s", "-1s", "0", "10 parsecs", "nan", "1e400h"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
