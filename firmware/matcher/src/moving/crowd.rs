//! Whether people are about: how much of the last scans lay on what moves.
//!
//! To leave out of match and map what might be somebody costs some of the walls, too. Where nobody is about
//! it would only make poses weaker.

/// What the newest scan counts.
const RATE: f64 = 0.02;
/// From this share of the end points on somebody is about.
const SOMEBODY: f64 = 0.015;
/// From this share on there are so many that they hide each other.
const MANY: f64 = 0.03;

/// The share of the end points that lay on what moves, lately.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Crowd {
    share: f64,
}

impl Crowd {
    /// Takes note of a scan: how many of its end points lie on what moves.
    pub(crate) fn update(&mut self, moving: usize, end_points: usize) {
        self.share += RATE * (moving as f64 / end_points.max(1) as f64 - self.share);
    }

    /// Whether somebody is about.
    pub(crate) fn is_somebody_about(self) -> bool {
        self.share > SOMEBODY
    }

    /// Whether there are many.
    pub(crate) fn is_dense(self) -> bool {
        self.share > MANY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn somebody_is_noticed_soon_and_forgotten_after_a_while() {
        let after = |scans: &[(usize, usize)]| {
            let mut crowd = Crowd::default();
            for (moving, times) in scans {
                (0..*times).for_each(|_| crowd.update(*moving, 180));
            }
            (crowd.is_somebody_about(), crowd.is_dense())
        };
        assert_eq!(after(&[(12, 11)]), (false, false));
        assert_eq!(after(&[(12, 15)]), (true, false));
        assert_eq!(after(&[(12, 40)]), (true, true));
        assert_eq!(after(&[(12, 40), (0, 30)]), (true, false));
        assert_eq!(after(&[(12, 40), (0, 120)]), (false, false));
        assert_eq!(after(&[(0, 100)]), (false, false));
    }
}
