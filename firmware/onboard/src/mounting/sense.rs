//! Whether a laser's scans move as the odometry says that the base has moved, or as they would if the laser looked elsewhere.
//!
//! Nothing is matched: two scans and the odometry between them are held beside each other for every way that the laser may
//! sit. That needs no map, so it works where the matcher is led astray by the very mistake that is looked for.

use biplane_matcher::Pose2;
use biplane_recording::rig::Mount;
use std::f64::consts::{FRAC_PI_2, PI};

use super::ballot::Ballot;
use super::profile::Profile;

/// Two scans are compared when the base has moved so far, metres.
const STEP_M: f64 = 0.4;
/// Or has turned so far, radians.
const STEP_RAD: f64 = 0.2;
/// A turn, radians.
const TURN_RAD: f64 = 0.15;
/// Not when it has moved further, metres: they may have nothing in common.
const WIDEST_M: f64 = 1.5;
/// Or has turned further, radians.
const WIDEST_RAD: f64 = 0.7;
/// Nor when they are so far apart, nanoseconds: odometry drifts, people walk.
const WIDEST_NS: i64 = 10_000_000_000;
/// A difference of agreements below this says nothing: in a corridor that goes on unchanged, standing still looks like driving.
const LEAST_LEAD: f32 = 0.12;
/// An explanation must itself agree with so many of the points.
const LEAST_AGREEMENT: f32 = 0.5;
/// So many pairs of scans tell that a laser is not level.
const ENOUGH_PAIRS: u32 = 4;
/// How fast the mean agreement follows.
const FOLLOWING: f32 = 0.15;
/// A mount counts as level when its scanning plane is this near to horizontal (cosine of 25 degrees).
const LEVEL: f64 = 0.906;

/// How scans can follow from the motion that the odometry tells.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Sense {
    /// As the rig has it.
    AsMounted,
    /// Left and right exchanged: they turn the other way.
    TurnsReversed,
    /// The laser looks backwards.
    Backwards,
    /// Both.
    BothReversed,
    /// The laser is turned a quarter to the left.
    Leftwards,
    /// Or to the right.
    Rightwards,
    /// The scans do not move when the base does.
    Still,
}

impl Sense {
    /// All but [`Sense::AsMounted`].
    const OTHERS: [Self; 6] = [
        Self::TurnsReversed,
        Self::Backwards,
        Self::BothReversed,
        Self::Leftwards,
        Self::Rightwards,
        Self::Still,
    ];

    /// The motion of a laser that sits like this, of a base that has moved.
    fn motion(self, base_from_laser: &Pose2, moved: &Pose2) -> Pose2 {
        let turned = |yaw_rad: f64| {
            let base_from_laser = *base_from_laser * Pose2::new(0.0, 0.0, yaw_rad);
            base_from_laser.inverse() * *moved * base_from_laser
        };
        let mirrored = |motion: Pose2| Pose2::new(motion.x_m, -motion.y_m, -motion.theta_rad);
        match self {
            Self::AsMounted => turned(0.0),
            Self::TurnsReversed => mirrored(turned(0.0)),
            Self::Backwards => turned(PI),
            Self::BothReversed => mirrored(turned(PI)),
            Self::Leftwards => turned(FRAC_PI_2),
            Self::Rightwards => turned(-FRAC_PI_2),
            Self::Still => Pose2::IDENTITY,
        }
    }
}

/// Where a level laser sits, seen from above.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct LevelMount {
    /// The laser in the base; of a laser on its back that of its mirror image.
    pub base_from_laser: Pose2,
    /// Whether it lies on its back.
    pub mirrored: bool,
}

impl LevelMount {
    /// Of a mount; `None` when its scans are not nearly level.
    #[must_use]
    pub fn of(mount: &Mount) -> Option<Self> {
        let matrix = mount.matrix();
        let yaw_rad = matrix[1][0].atan2(matrix[0][0]);
        let base_from_laser = Pose2::new(mount.x, mount.y, yaw_rad);
        (matrix[2][2].abs() >= LEVEL).then_some(Self { base_from_laser, mirrored: matrix[2][2] < 0.0 })
    }
}

/// A scan to which later ones are compared.
#[derive(Debug, Default)]
struct Key {
    stamp_ns: i64,
    profile: Profile,
    odom_from_base: Pose2,
}

/// Watches one laser's scans.
#[derive(Debug, Default)]
pub struct SenseWatch {
    /// Only what is seen while the base turns by so much counts, radians.
    least_turn_rad: f64,
    key: Option<Key>,
    ballots: [Ballot; Sense::OTHERS.len()],
    /// The mean agreement of each of the others.
    means: [f32; Sense::OTHERS.len()],
    /// The mean agreement of [`Sense::AsMounted`], of so many pairs of scans.
    as_mounted: (f32, u32),
}

impl SenseWatch {
    /// Of a laser whose scans are not level if the rig is right. While it drives straight on, a fan that stands upright along its way sees
    /// what is ahead come nearer, as a level one does: only in turns are they told apart.
    #[must_use]
    pub fn in_turns() -> Self {
        Self { least_turn_rad: TURN_RAD, ..Self::default() }
    }

    /// Whether the base has moved far enough for another scan to be of interest.
    #[must_use]
    pub fn wants(&self, odom_from_base: &Pose2) -> bool {
        self.key
            .as_ref()
            .is_none_or(|key| has_moved(&key.odom_from_base.between(odom_from_base), STEP_M, STEP_RAD))
    }

    /// A scan that was wanted, of a laser that should sit like this.
    pub fn see(&mut self, stamp_ns: i64, profile: Profile, odom_from_base: Pose2, base_from_laser: &Pose2) {
        let now = Key { stamp_ns, profile, odom_from_base };
        if let Some(before) = &self.key {
            let moved = before.odom_from_base.between(&odom_from_base);
            let apart_ns = stamp_ns.saturating_sub(before.stamp_ns);
            let is_turn = moved.theta_rad.abs() >= self.least_turn_rad;
            let is_near = !has_moved(&moved, WIDEST_M, WIDEST_RAD) && (0..WIDEST_NS).contains(&apart_ns);
            if is_turn
                && is_near
                && let Some(agreements) = agreements(before, &now, base_from_laser, &moved)
            {
                self.vote(agreements);
            }
        }
        self.key = Some(now);
    }

    fn vote(&mut self, (as_mounted, others): (f32, [Option<f32>; Sense::OTHERS.len()])) {
        let (mean, pairs) = &mut self.as_mounted;
        *pairs = pairs.saturating_add(1);
        let following = FOLLOWING.max(1.0 / *pairs as f32);
        *mean += following * (as_mounted - *mean);
        for (place, other) in others.into_iter().enumerate() {
            let Some(other) = other else { continue };
            self.ballots[place].vote(other - as_mounted, LEAST_LEAD);
            self.means[place] += following * (other - self.means[place]);
        }
    }

    /// Whether the scans have been seen often enough not to move as those of a level laser.
    #[must_use]
    pub fn is_surely_none(&self) -> bool {
        let (mean, pairs) = self.as_mounted;
        pairs >= ENOUGH_PAIRS && mean < LEAST_AGREEMENT
    }

    /// How the scans move; `None` while that cannot be told.
    #[must_use]
    pub fn verdict(&self) -> Option<Sense> {
        let others = Sense::OTHERS.into_iter().zip(self.ballots).zip(self.means);
        let best = others
            .filter(|((_, ballot), mean)| ballot.is_won() && *mean >= LEAST_AGREEMENT.max(self.as_mounted.0))
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some(((sense, _), _)) = best {
            return Some(sense);
        }
        // The last one is the hardest to tell from driving.
        self.ballots.last().is_some_and(Ballot::is_lost).then_some(Sense::AsMounted)
    }
}

fn has_moved(motion: &Pose2, step_m: f64, step_rad: f64) -> bool {
    let driven_m2 = motion.x_m * motion.x_m + motion.y_m * motion.y_m;
    driven_m2 >= step_m * step_m || motion.theta_rad.abs() >= step_rad
}

/// How well a scan agrees with an earlier one for [`Sense::AsMounted`], and for each of the others.
fn agreements(
    before: &Key,
    now: &Key,
    base_from_laser: &Pose2,
    moved: &Pose2,
) -> Option<(f32, [Option<f32>; Sense::OTHERS.len()])> {
    let agreement = |sense: Sense| {
        let motion = sense.motion(base_from_laser, moved);
        now.profile.agreement(&before.profile, &motion.inverse())
    };
    Some((agreement(Sense::AsMounted)?, Sense::OTHERS.map(agreement)))
}
