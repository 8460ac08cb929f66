//! Stamps as text: decimal seconds, exact to the nanosecond, in both directions.
//!
//! A CARMEN stamp such as `976052857.337530` has sixteen digits; a double would move it by up to 120 ns, so
//! the digits are read as integers.

const NS_DIGITS: i32 = 9;
const NS_PER_S: u64 = 1_000_000_000;

/// From the first to the last of some stamps, "1.5 to 2.0 s"; nothing where there is none.
pub(crate) fn format_span(stamps_ns: impl Iterator<Item = i64>) -> String {
    let span = stamps_ns.fold(None, |span: Option<[i64; 2]>, stamp_ns| {
        let [first_ns, last_ns] = span.unwrap_or([stamp_ns; 2]);
        Some([first_ns.min(stamp_ns), last_ns.max(stamp_ns)])
    });
    span.map_or_else(
        || "nothing".to_owned(),
        |[first_ns, last_ns]| format!("{} to {} s", format_seconds(first_ns), format_seconds(last_ns)),
    )
}

/// Writes nanoseconds as seconds with nine decimals.
pub fn format_seconds(stamp_ns: i64) -> String {
    let sign = if stamp_ns < 0 { "-" } else { "" };
    let magnitude = stamp_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / NS_PER_S, magnitude % NS_PER_S)
}

/// Reads `[+-]digits[.digits][e[+-]digits]` seconds as nanoseconds, rounded half away from zero; `None` for
/// anything else and for times that do not fit.
pub fn parse_seconds_ns(text: &str) -> Option<i64> {
    let (negative, unsigned) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i16>().ok()?),
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    // Digits past the nanosecond are dropped but for the first of them, which rounds.
    let keep = i32::try_from(whole.len()).ok()? + i32::from(exponent) + NS_DIGITS;
    let mut value: i64 = 0;
    let mut round_up = false;
    let mut position = 0;
    for digit in whole.bytes().chain(fraction.bytes()) {
        if !digit.is_ascii_digit() {
            return None;
        }
        if position < keep {
            value = value.checked_mul(10)?.checked_add(i64::from(digit - b'0'))?;
        } else if position == keep {
            round_up = digit >= b'5';
        }
        position += 1;
    }
    for _ in position..keep {
        if value == 0 {
            break;
        }
        value = value.checked_mul(10)?;
    }
    value = value.checked_add(i64::from(round_up))?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::{format_seconds, parse_seconds_ns};

    #[test]
    fn seconds_are_read_exactly_to_the_nanosecond() {
        let table = [
            ("976052857.337530", Some(976_052_857_337_530_000)),
            ("1134864629.894634", Some(1_134_864_629_894_634_000)),
            ("0", Some(0)),
            ("70.29", Some(70_290_000_000)),
            (".5", Some(500_000_000)),
            ("5.", Some(5_000_000_000)),
            ("-1.25", Some(-1_250_000_000)),
            ("+2", Some(2_000_000_000)),
            ("1.123456789", Some(1_123_456_789)),
            ("1.1234567894", Some(1_123_456_789)),
            ("1.1234567895", Some(1_123_456_790)),
            ("0.0000000005", Some(1)),
            ("9.76052857e8", Some(976_052_857_000_000_000)),
            ("1e-9", Some(1)),
            ("0.00000000049e1", Some(5)),
            ("0e300", Some(0)),
            ("9223372036.854775807", Some(i64::MAX)),
            ("9223372036.854775808", None),
            ("1e300", None),
            ("", None),
            ("-", None),
            (".", None),
            ("nan", None),
            ("12:30", None),
            ("1,5", None),
            ("1.2.3", None),
            ("1é", None),
        ];
        for (text, expected) in table {
            assert_eq!(parse_seconds_ns(text), expected, "{text:?}");
        }
    }

    #[test]
    fn what_is_written_reads_back() {
        let table = [
            (0, "0.000000000"),
            (976_052_857_337_530_000, "976052857.337530000"),
            (-1_500_000_000, "-1.500000000"),
        ];
        for (stamp_ns, text) in table {
            assert_eq!(format_seconds(stamp_ns), text);
            assert_eq!(parse_seconds_ns(text), Some(stamp_ns));
        }
        assert_eq!(parse_seconds_ns(&format_seconds(i64::MAX)), Some(i64::MAX));
    }
}
