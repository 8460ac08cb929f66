//! What the odometry is worth: how well its steps foretold those that the scans then showed.
//!
//! Units: meters, radians; steps in the base's frame.

use biplane_geometry::{Pose2, wrap_angle};

/// What the newest comparison counts. Larger: quicker to doubt and to believe again.
const RATE: f64 = 0.25;
/// What a scan that says nothing takes away of what was seen before.
const FADE_RATE: f64 = 0.01;
/// The most that one comparison says, standard deviations squared: one slip is no lie.
const MAX_SQUARED: f64 = 36.0;
/// Mean squared standard deviations from which on the odometry is contradicted.
const CONTRADICTED_ABOVE: f64 = 9.0;
/// The same below which it is believed again.
const CONSISTENT_BELOW: f64 = 4.0;
/// From so many standard deviations squared on a step was wrong.
const WRONG: f64 = 9.0;
/// What the newest comparison counts for the share of wrong steps.
const WRONG_RATE: f64 = 0.03;
/// Odometry of which a smaller share of the steps was wrong is reliable.
const RELIABLE: f64 = 0.06;
/// Shorter steps say nothing of the sign, meters.
const SAYS_SIGN_M: f64 = 0.02;

/// How the odometry's steps are to be read.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) enum Reading {
    /// As they are.
    #[default]
    AsIs,
    /// With the way driven reversed.
    Reversed,
    /// Not at all.
    Contradicted,
}

impl Reading {
    /// The step as it is to be read.
    pub(crate) fn of(self, step: &Pose2) -> Pose2 {
        match self {
            Self::AsIs | Self::Contradicted => *step,
            Self::Reversed => Pose2::new(-step.x_m, -step.y_m, step.theta_rad),
        }
    }
}

/// Compares the odometry's steps with those found by matching.
#[derive(Clone, Debug)]
pub(crate) struct Consistency {
    as_is: f64,
    reversed: f64,
    heading: f64,
    reading: Reading,
    /// The share of its steps that were wrong, lately.
    wrong: f64,
}

impl Default for Consistency {
    /// Odometry that has shown nothing yet is right, and not known to be reliable.
    fn default() -> Self {
        Self { as_is: 0.0, reversed: MAX_SQUARED, heading: 0.0, reading: Reading::AsIs, wrong: 1.0 }
    }
}

impl Consistency {
    /// How the next step is to be read.
    pub(crate) fn reading(&self) -> Reading {
        self.reading
    }

    /// Whether hardly any of its steps has been wrong lately.
    pub(crate) fn is_reliable(&self) -> bool {
        self.wrong < RELIABLE
    }

    /// By how much the odometry's own standard deviations (position, heading) have proved too small.
    pub(crate) fn inflation(&self) -> [f64; 2] {
        [self.as_is.min(self.reversed), self.heading].map(|squared| squared.max(1.0).sqrt())
    }

    /// The odometry's step and its standard deviations, and the step that was matched in every direction.
    pub(crate) fn compare(&mut self, odometry: &Pose2, sigma: [f64; 3], matched: &Pose2) {
        let off = |reading: Reading| {
            let step = reading.of(odometry);
            let (x, y) = ((step.x_m - matched.x_m) / sigma[0], (step.y_m - matched.y_m) / sigma[1]);
            (x * x + y * y).min(MAX_SQUARED)
        };
        let turn = wrap_angle(odometry.theta_rad - matched.theta_rad) / sigma[2];
        self.heading += RATE * ((turn * turn).min(MAX_SQUARED) - self.heading);
        let off_as_is = off(Reading::AsIs);
        self.as_is += RATE * (off_as_is - self.as_is);
        if odometry.distance_m() > SAYS_SIGN_M {
            self.reversed += RATE * (off(Reading::Reversed) - self.reversed);
        }
        self.wrong += WRONG_RATE * (f64::from(u8::from(off_as_is > WRONG)) - self.wrong);
        self.reading = self.next();
    }

    /// A scan that does not tell in every direction says nothing of the odometry; what was seen before fades.
    pub(crate) fn fade(&mut self) {
        self.as_is -= FADE_RATE * self.as_is;
        self.reversed += FADE_RATE * (MAX_SQUARED - self.reversed);
        self.heading -= FADE_RATE * self.heading;
        self.reading = self.next();
    }

    fn next(&self) -> Reading {
        let (squared, reading) = if self.reversed < self.as_is {
            (self.reversed, Reading::Reversed)
        } else {
            (self.as_is, Reading::AsIs)
        };
        if squared < CONSISTENT_BELOW {
            return reading;
        }
        if self.as_is > CONTRADICTED_ABOVE { Reading::Contradicted } else { self.reading }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMA: [f64; 3] = [0.02, 0.02, 0.01];
    const AHEAD: Pose2 = Pose2::new(0.1, 0.0, 0.0);

    fn after(steps: &[(Pose2, Pose2)]) -> Consistency {
        let mut consistency = Consistency::default();
        steps.iter().for_each(|(odometry, matched)| consistency.compare(odometry, SIGMA, matched));
        consistency
    }

    #[test]
    fn odometry_that_foretells_the_steps_is_read_as_it_is_and_one_slip_changes_nothing() {
        let slip = (AHEAD, Pose2::new(-0.4, 0.0, 0.0));
        let consistency = after(&[(AHEAD, AHEAD), (AHEAD, AHEAD), slip]);
        assert_eq!(consistency.reading(), Reading::AsIs);
        assert!(
            consistency.inflation()[0] > 1.0 && consistency.inflation()[1] == 1.0,
            "{:?}",
            consistency.inflation()
        );
    }

    #[test]
    fn steps_of_the_wrong_sign_are_reversed_and_right_ones_read_as_they_are_again() {
        let back = Pose2::new(-0.1, 0.0, 0.0);
        let mut steps = vec![(AHEAD, AHEAD); 5];
        steps.extend([(AHEAD, back); 10]);
        let reversed = after(&steps).reading();
        assert_eq!((reversed, reversed.of(&AHEAD)), (Reading::Reversed, back));
        steps.extend([(AHEAD, AHEAD); 10]);
        assert_eq!(after(&steps).reading(), Reading::AsIs);
    }

    #[test]
    fn odometry_becomes_reliable_by_many_right_steps_and_is_not_after_three_wrong_ones() {
        let mut steps = vec![(AHEAD, AHEAD); 90];
        assert!(!after(&steps).is_reliable());
        steps.extend([(AHEAD, AHEAD); 10]);
        assert!(after(&steps).is_reliable());
        steps.extend([(Pose2::IDENTITY, AHEAD); 3]);
        assert!(!after(&steps).is_reliable());
    }

    #[test]
    fn odometry_that_says_anything_is_contradicted_until_it_fits_again() {
        let mut steps = vec![(Pose2::new(0.0, 0.15, 0.0), AHEAD); 4];
        assert_eq!(after(&steps).reading(), Reading::Contradicted);
        steps.extend([(AHEAD, AHEAD); 12]);
        assert_eq!(after(&steps).reading(), Reading::AsIs);
    }

    #[test]
    fn what_was_seen_of_the_odometry_fades_where_scans_say_nothing() {
        let mut consistency = after(&[(AHEAD, Pose2::new(0.0, 0.2, 0.0)); 4]);
        assert_eq!(consistency.reading(), Reading::Contradicted);
        (0..300).for_each(|_| consistency.fade());
        assert_eq!(consistency.reading(), Reading::AsIs);
    }
}
