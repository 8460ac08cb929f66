//! Which range of a log means "nothing came back".
//!
//! A SICK LMS at 1 cm marks it with the top codes of its 13 bits (81.83 to 81.91 m); other logs were clipped
//! by whoever wrote them (50.00 in ACES). Such a value stands at the top of all ranges and comes far more
//! often than anything measured just below it.

use std::collections::BTreeMap;

/// Range codes of an LMS 2xx that are no range: 8183 to 8191 centimeters.
const LMS_CODES_CM: std::ops::RangeInclusive<i64> = 8183..=8191;
/// A top value that comes less often than this is a measured range.
const MIN_COUNT: u64 = 20;
/// The same for a whole multiple of ten meters, where people clip.
const MIN_COUNT_ROUND: u64 = 3;
/// A marker comes this many times as often as all ranges within [`NEIGHBORHOOD`] below it together.
const MIN_RATIO: u64 = 2;
/// Part of the value that counts as "just below it".
const NEIGHBORHOOD: f64 = 0.05;
/// Ranges are counted in steps of a tenth of a millimeter.
const STEPS_PER_M: i64 = 10_000;
/// Ranges beyond this are no ranges of any scanner and are not counted.
const LONGEST_M: f32 = 100_000.0;

/// Counts of the ranges of a log; its memory is bounded by the number of different ranges.
#[derive(Debug, Default)]
pub(crate) struct RangeCounts {
    counts: BTreeMap<i64, u64>,
    previous: Vec<f32>,
}

impl RangeCounts {
    /// Takes one scan, meters. A beam that says what it said in the scan before is not counted again: a robot
    /// that stands still repeats measured ranges too.
    pub(crate) fn add_scan(&mut self, ranges_m: &[f32]) {
        let same_laser_config = self.previous.len() == ranges_m.len();
        for (beam, &range_m) in ranges_m.iter().enumerate() {
            let repeated = same_laser_config && self.previous.get(beam) == Some(&range_m);
            if !repeated && range_m > 0.0 && range_m < LONGEST_M {
                let steps = (f64::from(range_m) * STEPS_PER_M as f64).round() as i64;
                *self.counts.entry(steps).or_default() += 1;
            }
        }
        self.previous.clear();
        self.previous.extend_from_slice(ranges_m);
    }

    /// The largest range counted, in meters.
    pub(crate) fn largest_m(&self) -> Option<f64> {
        self.counts.keys().next_back().map(|&steps| meters(steps))
    }

    /// The smallest value that marks "no return", in meters: this and everything above is no range. `None`
    /// when every range looks measured.
    pub(crate) fn no_return_m(&self) -> Option<f64> {
        let mut found = None;
        for (&steps, &count) in self.counts.iter().rev() {
            if is_lms_code(steps) {
                found = Some(steps);
                continue;
            }
            if self.stands_out(steps, count) {
                found = Some(steps);
            }
            break;
        }
        found.map(meters)
    }

    fn stands_out(&self, steps: i64, count: u64) -> bool {
        let from = (steps as f64 * (1.0 - NEIGHBORHOOD)) as i64;
        let below: u64 = self.counts.range(from..steps).map(|(_, count)| count).sum();
        let enough = if steps % (10 * STEPS_PER_M) == 0 { MIN_COUNT_ROUND } else { MIN_COUNT };
        count >= enough && count >= below.saturating_mul(MIN_RATIO)
    }
}

fn meters(steps: i64) -> f64 {
    steps as f64 / STEPS_PER_M as f64
}

fn is_lms_code(steps: i64) -> bool {
    let steps_per_cm = STEPS_PER_M / 100;
    steps % steps_per_cm == 0 && LMS_CODES_CM.contains(&(steps / steps_per_cm))
}

#[cfg(test)]
mod tests {
    use super::RangeCounts;

    /// One scan that holds every range as often as asked.
    fn counted(groups: &[(f32, usize)]) -> RangeCounts {
        let mut counts = RangeCounts::default();
        let scan: Vec<f32> =
            groups.iter().flat_map(|&(range_m, times)| std::iter::repeat_n(range_m, times)).collect();
        counts.add_scan(&scan);
        counts
    }

    /// Ranges and how often.
    type Groups = &'static [(f32, usize)];

    #[test]
    fn the_marker_of_each_kind_of_log_is_found() {
        let table: [(Groups, Option<f64>); 9] = [
            (&[(1.08, 900), (9.99, 3), (81.83, 400)], Some(81.83)),
            (&[(1.08, 900), (42.4, 1), (81.83, 1), (81.91, 2)], Some(81.83)),
            (&[(1.04, 900), (49.76, 98), (49.81, 40), (50.0, 11_137)], Some(50.0)),
            (&[(1.04, 9), (2.5, 4), (50.0, 3)], Some(50.0)),
            (&[(1.04, 900), (2.5, 400), (31.99, 19)], None),
            (&[(1.04, 900), (2.5, 400), (31.99, 20)], Some(31.99)),
            // A room without any gap: the farthest wall is no marker, seen once or often.
            (&[(7.98, 500), (7.99, 700), (8.0, 600)], None),
            // Clipped at 50 m by one program, with codes of the device above it.
            (&[(2.0, 900), (50.0, 500), (81.91, 3)], Some(50.0)),
            (&[], None),
        ];
        for (groups, expected) in table {
            assert_eq!(counted(groups).no_return_m(), expected, "{groups:?}");
        }
    }

    #[test]
    fn a_robot_that_stands_still_repeats_its_farthest_range_and_that_is_no_marker() {
        let mut counts = RangeCounts::default();
        for _ in 0..1000 {
            counts.add_scan(&[1.0, 2.0, 9.37]);
        }
        assert_eq!(counts.no_return_m(), None);
    }

    #[test]
    fn nonsense_ranges_are_not_counted() {
        let counts =
            counted(&[(f32::NAN, 50), (f32::INFINITY, 50), (-1.0, 50), (0.0, 50), (1e30, 50), (2.5, 1)]);
        assert_eq!(counts.no_return_m(), None);
        assert_eq!(counts.largest_m(), Some(2.5));
    }
}
