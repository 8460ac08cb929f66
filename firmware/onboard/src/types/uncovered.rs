//! A device that was there for a part of a run only.

use serde::Serialize;

/// A device that starts so long after the others, or ends so long before them, is told of, seconds. Lasers
/// that are found at their rate start within it.
const MAX_UNCOVERED_S: f64 = 3.0;

/// The begin and the end of a run as far as a device measured nothing there.
#[derive(Copy, Clone, PartialEq, Debug, Serialize)]
pub struct Uncovered {
    /// The device: `horizontal laser`, `vertical laser` or `base`.
    pub device: &'static str,
    /// From the first measurement of any device to its first, seconds.
    pub at_start_s: f64,
    /// From its last measurement to the last of any device, seconds.
    pub at_end_s: f64,
}

impl Uncovered {
    /// Those of these devices that missed a part of the run. Each is there with the times of its first and
    /// last measurement, nanoseconds.
    pub(crate) fn of(spans: &[(&'static str, (i64, i64))]) -> Vec<Self> {
        let (start_ns, end_ns) = spans
            .iter()
            .fold((i64::MAX, i64::MIN), |(start, end), (_, span)| (start.min(span.0), end.max(span.1)));
        let seconds = |from_ns: i64, to_ns: i64| to_ns.saturating_sub(from_ns) as f64 * 1e-9;
        let of_device = |&(device, (first_ns, last_ns)): &(&'static str, (i64, i64))| Self {
            device,
            at_start_s: seconds(start_ns, first_ns),
            at_end_s: seconds(last_ns, end_ns),
        };
        let is_long = |uncovered: &Self| uncovered.at_start_s.max(uncovered.at_end_s) > MAX_UNCOVERED_S;
        spans.iter().map(of_device).filter(is_long).collect()
    }

    /// What is missing, in words.
    pub(crate) fn words(&self) -> String {
        let of = |seconds: f64, place: &str| {
            (seconds > MAX_UNCOVERED_S).then(|| format!("in the {place} {seconds:.1} s"))
        };
        let places = [of(self.at_start_s, "first"), of(self.at_end_s, "last")];
        let places: Vec<_> = places.into_iter().flatten().collect();
        format!("{}: nothing {}", self.device, places.join(" and "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    #[test]
    fn a_device_that_came_late_or_went_early_is_told_of_and_one_of_a_usual_start_is_not() {
        let spans = [
            ("horizontal laser", (2 * S, 24 * S)),
            ("vertical laser", (11 * S, 20 * S)),
            ("base", (0, 25 * S)),
        ];
        let words: Vec<_> = Uncovered::of(&spans).iter().map(Uncovered::words).collect();
        assert_eq!(words, ["vertical laser: nothing in the first 11.0 s and in the last 5.0 s"]);
        assert!(Uncovered::of(&[]).is_empty());
    }
}
