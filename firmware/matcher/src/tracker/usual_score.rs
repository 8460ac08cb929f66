//! How much of a scan is usually explained, and which scans fall short of it.
//!
//! A robot that leans forward over a door sill sees the floor ahead: a line right across the way that moves
//! as the robot leans. Such a scan explains less than the ones before it, all at once. A match of it may be
//! led astray, and what it sees may not be there.

/// What the newest scan counts. Larger: a place that has changed is learned sooner; smaller: the floor is
/// kept out of the map for longer.
const RATE: f64 = 0.02;
/// Below this share of what is usual a scan contradicts the map. Larger: more scans wait to be learned.
const CONTRADICTS: f64 = 0.95;
/// Below this share a match of it may be led astray. Larger: odometry that is wrong is noticed later.
const MISLEADS: f64 = 0.9;
/// Below this share a scan has hardly seen what the map knows. A match of it that nothing expects has to be
/// confirmed.
const HARDLY: f64 = 0.8;
/// Below this share a match of it that leaps away from where inertia alone expects the base has to be
/// confirmed, too. Larger: where the base turns and scans come irregularly, right matches wait.
const LEAPS: f64 = 0.65;

/// The share of the end points that scans explained lately.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct UsualScore {
    share: Option<f64>,
}

impl UsualScore {
    /// Takes note of what a scan explained, 0 to 1.
    pub(crate) fn note(&mut self, score: f64) {
        let share = self.share.get_or_insert(score);
        *share += RATE * (score - *share);
    }

    /// Whether a scan that explains so much contradicts the map, unlike those before it.
    pub(crate) fn is_contradicted_by(self, score: f64) -> bool {
        self.is_short(score, CONTRADICTS)
    }

    /// Whether a scan that explains so much may lead its match astray.
    pub(crate) fn is_misled_by(self, score: f64) -> bool {
        self.is_short(score, MISLEADS)
    }

    /// Whether a scan that explains so much has hardly seen what the map knows, unlike those before it.
    pub(crate) fn is_far_above(self, score: f64) -> bool {
        self.is_short(score, HARDLY)
    }

    /// Whether a scan that explains so much is no reason for a leap where only inertia expects the base
    /// somewhere.
    pub(crate) fn forbids_a_leap_by(self, score: f64) -> bool {
        self.is_short(score, LEAPS)
    }

    fn is_short(self, score: f64, of_usual: f64) -> bool {
        self.share.is_some_and(|share| score < of_usual * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_falls_short_of_those_before_it_until_many_are_like_it() {
        let after = |scores: &[(f64, usize)]| {
            let mut usual = UsualScore::default();
            scores.iter().for_each(|(score, times)| (0..*times).for_each(|_| usual.note(*score)));
            usual
        };
        let judged = |usual: UsualScore, score| {
            [
                usual.is_contradicted_by(score),
                usual.is_misled_by(score),
                usual.is_far_above(score),
                usual.forbids_a_leap_by(score),
            ]
        };
        assert_eq!(judged(UsualScore::default(), 0.1), [false; 4], "nothing is known yet");
        assert_eq!(judged(after(&[(0.97, 1)]), 0.95), [false; 4]);
        assert_eq!(judged(after(&[(0.97, 50)]), 0.9), [true, false, false, false]);
        assert_eq!(judged(after(&[(0.97, 50)]), 0.8), [true, true, false, false]);
        assert_eq!(judged(after(&[(0.97, 50)]), 0.7), [true, true, true, false]);
        assert_eq!(judged(after(&[(0.97, 50)]), 0.6), [true; 4]);
        // The floor is seen for a second or two; a door that was shut stays shut.
        assert_eq!(judged(after(&[(0.97, 50), (0.8, 20)]), 0.8), [true, true, false, false]);
        assert_eq!(judged(after(&[(0.97, 50), (0.8, 80)]), 0.8), [false; 4]);
    }
}
