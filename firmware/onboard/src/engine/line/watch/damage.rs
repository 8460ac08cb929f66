//! The share of a line's telegrams that arrive damaged, over the last ten seconds: a cable that is about to
//! fail is told before it does, and a computer that has too much to do is not taken for a bad cable.

use crate::engine::out::health::{DamagedShare, LineHealth};
use crate::session::event::Event;

/// Seconds that are looked back.
const SECONDS: usize = 10;
/// Beyond this share of damaged telegrams a line is damaged. Smaller: a disturbance now and then is told.
const BEGINS: f64 = 0.01;
/// Below this share it is no more.
const ENDS: f64 = 0.005;
/// One or two damaged telegrams are chance, whatever share of a slow line they are.
const MINIMUM: u64 = 3;

/// What arrived so far, or lately.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
struct Tally {
    intact: u64,
    damaged: u64,
    overruns: u64,
}

impl Tally {
    /// Damaged are those that show it by checksum, length or form, and those that were cut.
    fn of(line: &LineHealth) -> Self {
        let counts = line.counts.unwrap_or_default();
        let rejected = line.laser.map_or(0, |laser| laser.rejected);
        let damaged = counts.bad_checksums + counts.bad_lengths + counts.abandoned + rejected;
        Self { intact: counts.frames.saturating_sub(rejected), damaged, overruns: line.overruns }
    }

    fn since(self, before: Self) -> Self {
        Self {
            intact: self.intact.saturating_sub(before.intact),
            damaged: self.damaged.saturating_sub(before.damaged),
            overruns: self.overruns.saturating_sub(before.overruns),
        }
    }

    fn share(self) -> f64 {
        self.damaged as f64 / (self.intact + self.damaged).max(1) as f64
    }
}

/// Watches one line.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Damage {
    before: Tally,
    seconds: [Tally; SECONDS],
    next: usize,
    is_on: bool,
}

impl Damage {
    /// A second has passed; what arrived lately while the share of damaged telegrams is too large.
    fn see(&mut self, line: &LineHealth) -> Option<Tally> {
        let now = Tally::of(line);
        // While a device is looked for, noise is what a wrong rate makes of its telegrams.
        let new = if line.streaming { now.since(self.before) } else { Tally::default() };
        self.before = now;
        if let Some(second) = self.seconds.get_mut(self.next) {
            *second = new;
        }
        self.next = (self.next + 1) % SECONDS;
        let lately = self.seconds.iter().fold(Tally::default(), |sum, second| Tally {
            intact: sum.intact + second.intact,
            damaged: sum.damaged + second.damaged,
            overruns: sum.overruns + second.overruns,
        });
        self.is_on = match self.is_on {
            true => lately.share() >= ENDS,
            false => lately.share() > BEGINS && lately.damaged >= MINIMUM,
        };
        self.is_on.then_some(lately)
    }

    /// The state of the line with the share of its telegrams that arrive damaged, where that is too large;
    /// and what is to be said when that begins or ends.
    pub(crate) fn judge(&mut self, line: LineHealth) -> (LineHealth, Option<Event>) {
        let was_on = self.is_on;
        let lately = self.see(&line);
        let damaged_share = lately.map(Tally::share);
        let is_overrun = lately.is_some_and(|lately| lately.overruns > 0);
        let percent = damaged_share.map(|share| (share * 100.0).round().clamp(1.0, 100.0) as u8);
        let event = (was_on != damaged_share.is_some()).then_some(Event::Damaged { percent, is_overrun });
        let damaged = damaged_share.map(|share| DamagedShare { share, is_overrun });
        (LineHealth { damaged, ..line }, event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_wire::Counts;

    /// Lines of so many intact and damaged telegrams a second, and what is told of them.
    fn reported(seconds: &[(u64, u64)]) -> Vec<Option<f64>> {
        let mut damage = Damage::default();
        let mut counts = Counts::default();
        let see = |&(intact, damaged): &(u64, u64)| {
            counts.frames += intact;
            counts.bad_checksums += damaged;
            let line = LineHealth { streaming: true, counts: Some(counts), ..LineHealth::default() };
            damage.see(&line).map(Tally::share)
        };
        seconds.iter().map(see).collect()
    }

    #[test]
    fn more_than_one_in_a_hundred_damaged_is_told_until_nearly_all_are_intact_for_ten_seconds() {
        assert!(reported(&[(37, 0); 20]).iter().all(Option::is_none));
        // One or two are chance, also on a line of five a second.
        assert!(reported(&[(5, 2), (5, 0), (5, 0)]).iter().all(Option::is_none));
        // The third begins it; it lasts until the last of them is ten seconds old.
        let mut seconds = vec![(5, 0), (4, 1), (4, 1), (4, 1)];
        seconds.extend([(5, 0); 12]);
        let reported = reported(&seconds);
        let on: Vec<_> = (0..reported.len()).filter(|&second| reported[second].is_some()).collect();
        assert_eq!(on, (3..13).collect::<Vec<_>>());
        assert_eq!(reported[3], Some(0.15));
    }

    #[test]
    fn telegrams_cut_by_a_full_buffer_are_no_sign_of_a_bad_cable() {
        let mut damage = Damage::default();
        let mut see = |frames: u64, abandoned: u64, overruns: u64| {
            let counts = Some(Counts { frames, abandoned, ..Counts::default() });
            let line = LineHealth { streaming: true, counts, overruns, ..LineHealth::default() };
            damage.see(&line).map(|lately| lately.overruns > 0)
        };
        assert_eq!(see(37, 0, 0), None);
        assert_eq!(see(69, 4, 2), Some(true));
        for second in 1..10 {
            assert_eq!(see(69 + 37 * second, 4, 2), Some(true));
        }
        assert_eq!(see(439, 4, 2), None);
        assert_eq!(see(470, 10, 2), Some(false));
    }

    #[test]
    fn what_a_search_hears_is_no_damage() {
        let mut damage = Damage::default();
        let counts = Some(Counts { bad_checksums: 50, ..Counts::default() });
        let searching = LineHealth { streaming: false, counts, ..LineHealth::default() };
        assert_eq!(damage.see(&searching), None);
        assert_eq!(damage.see(&LineHealth { streaming: true, ..searching }), None);
    }
}
