//! At which rates a laser on a serial line is looked for, one after the other.

use biplane_wire::scip::BAUDS;

/// The rate after power-on, of lasers with RS-232.
const POWER_ON_BAUD: u32 = 19_200;
/// Rates that a port may lack.
const MAX_LACKING: usize = 8;
/// Polls of the first round, which looks at every rate once, and of a later one.
const FIRST_ROUND: u32 = BAUDS.len() as u32;
const LATER_ROUND: u32 = 2 * FIRST_ROUND;

/// The rates.
#[derive(Clone, Debug)]
pub(crate) struct Rates {
    /// The rate of the rig.
    pub(crate) wanted: u32,
    /// Where the laser was heard last, or should be.
    likely: u32,
    poll: u32,
    port_lacks: heapless::Vec<u32, MAX_LACKING>,
}

impl Rates {
    pub(crate) fn new(wanted: u32) -> Self {
        Self { wanted, likely: wanted, poll: 0, port_lacks: heapless::Vec::new() }
    }

    /// The laser is at this rate.
    pub(crate) fn is_at(&mut self, baud: u32) {
        self.likely = baud;
    }

    /// The search begins anew, where the laser most likely is.
    pub(crate) fn restart(&mut self) {
        self.poll = 0;
    }

    /// Rounds over all rates that are behind.
    pub(crate) fn rounds(&self) -> u32 {
        self.poll.saturating_add(LATER_ROUND - FIRST_ROUND) / LATER_ROUND
    }

    /// The port does not run at this rate.
    pub(crate) fn lacks(&mut self, baud: u32) {
        if !self.port_lacks.contains(&baud) {
            // More rates than there are do not come.
            let _ = self.port_lacks.push(baud);
        }
    }

    /// The next rate to look at: each of them once, then every other time where the laser likely is (its
    /// cable was loose) or where it is when it was switched on.
    pub(crate) fn next(&mut self) -> u32 {
        for _ in 0..LATER_ROUND {
            let place = self.poll;
            self.poll = self.poll.wrapping_add(1);
            let baud = self.candidate(place);
            if !self.port_lacks.contains(&baud) {
                return baud;
            }
        }
        self.likely
    }

    fn candidate(&self, place: u32) -> u32 {
        let mut others = BAUDS.into_iter().filter(|&baud| baud != self.likely);
        let nth = |place: u32| BAUDS[place as usize % BAUDS.len()];
        match place {
            0 => self.likely,
            place if place < FIRST_ROUND => others.nth(place as usize - 1).unwrap_or(self.likely),
            place if place % 4 == 0 => self.likely,
            place if place % 4 == 2 => POWER_ON_BAUD,
            place => nth(place / 2),
        }
    }
}
