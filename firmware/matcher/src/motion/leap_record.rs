//! How the odometry's leaps turned out: the base made them, or it did not.
//!
//! Where scans come in a wrong order leaps are true, also large ones. Where the odometry jumps they are not.
//! So leaps are counted by their size, each doubling for itself: a jump of a meter says nothing of a start
//! from standing. Sizes are in standard deviations of what inertia foretells.

use biplane_geometry::PortableMath;

/// So many doublings of the size are told apart, from one standard deviation on.
const SIZES: usize = 6;
/// What a leap leaves of what those before it have shown: about 50 of them count. With scans in a wrong order
/// the error was 0.0247 to 0.0250 m when 10, 25, 50, 100 or all counted, measured while smaller leaps were
/// noted too.
const KEPT: f64 = 0.98;
/// Leaps that count as made before the first was seen: the odometry is believed until scans contradict it.
const MADE_BEFORE: f64 = 1.0;
/// The same as not made. In a simulated corridor with swapped scans the error was 0.34 m, with ten times as
/// many 0.38 m, measured at the same time.
const NOT_MADE_BEFORE: f64 = 0.1;

/// Leaps that the base made, and leaps that it did not make, by size.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeapRecord {
    sizes: [Tally; SIZES],
}

#[derive(Copy, Clone, Debug, Default)]
struct Tally {
    made: f64,
    not_made: f64,
}

impl LeapRecord {
    /// Natural logarithm of the odds that a leap of this size, squared, was not made.
    pub(crate) fn odds_against(&self, squared: f64) -> f64 {
        let Tally { made, not_made } = self.sizes[size(squared)];
        ((not_made + NOT_MADE_BEFORE) / (made + MADE_BEFORE)).portable_ln()
    }

    /// Takes note of a leap of this size, squared, and of what a scan showed of it.
    pub(crate) fn note(&mut self, squared: f64, was_made: bool) {
        let tally = &mut self.sizes[size(squared)];
        let of = |count: f64, is_this: bool| KEPT * count + f64::from(u8::from(is_this));
        *tally = Tally { made: of(tally.made, was_made), not_made: of(tally.not_made, !was_made) };
    }
}

/// The doubling in which a size, squared, lies.
fn size(squared: f64) -> usize {
    let doublings = 0.5 * squared.portable_log2();
    // No number and sizes below one count as the smallest.
    (doublings.max(0.0) as usize).min(SIZES - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The odds of a leap of this size, squared, after so many of size 20 of which the base made none, and so
    /// many of size 2 of which it made all.
    fn odds_against(squared: f64, not_made: usize, made: usize) -> f64 {
        let mut record = LeapRecord::default();
        (0..not_made).for_each(|_| record.note(400.0, false));
        (0..made).for_each(|_| record.note(4.0, true));
        record.odds_against(squared)
    }

    #[test]
    fn a_leap_is_believed_until_more_of_its_size_were_not_made_than_made() {
        assert!(odds_against(400.0, 0, 0) < -2.0);
        assert!(odds_against(300.0, 20, 20) > 2.0, "nearly as large");
        assert!(odds_against(5.0, 20, 20) < -4.0);
        assert_eq!(odds_against(60.0, 20, 20), odds_against(60.0, 0, 0), "another size");
    }

    #[test]
    fn what_was_shown_long_ago_fades() {
        let mut record = LeapRecord::default();
        (0..1000).for_each(|_| record.note(400.0, false));
        (0..60).for_each(|_| record.note(400.0, true));
        assert!(record.odds_against(400.0) < 0.0, "{record:?}");
    }

    #[test]
    fn any_size_has_its_place() {
        for squared in [f64::NAN, -1.0, 0.0, 1.0, f64::MAX, f64::INFINITY] {
            let mut record = LeapRecord::default();
            record.note(squared, false);
            assert!(record.odds_against(squared) > -0.1, "{squared}");
        }
    }
}
