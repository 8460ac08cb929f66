//! Whether a laser's scans move as the odometry says that the base has moved, or as they would if the laser
//! looked elsewhere.
//!
//! Nothing is matched: two scans and the odometry between them are held beside each other for every way that
//! the laser may sit. That needs no map, so it works where the matcher is led astray by the very mistake that
//! is looked for.

use biplane_geometry::PortableMath;
use biplane_matcher::Pose2;
use biplane_recording::rig::Mount;
use std::f64::consts::{FRAC_PI_2, PI};

use crate::engine::mount_check::range_profile::Profile;
use crate::engine::mount_check::vote::VoteCount;
use crate::types::mount_fault::Sense;

/// Two scans are compared when the base has moved so far, meters.
const STEP_M: f64 = 0.4;
/// Or has turned so far, radians.
const STEP_RAD: f64 = 0.2;
/// A turn, radians.
const TURN_RAD: f64 = 0.15;
/// Not when it has moved further, meters: they may have nothing in common.
const WIDEST_M: f64 = 1.5;
/// Or has turned further, radians.
const WIDEST_RAD: f64 = 0.7;
/// Nor when they are so far apart, nanoseconds: odometry drifts, people walk.
const WIDEST_NS: i64 = 10_000_000_000;
/// A difference of agreements below this says nothing: in a corridor that goes on unchanged, standing still
/// looks like driving.
const MIN_LEAD: f32 = 0.12;
/// An explanation must itself agree with so many of the points.
const MIN_AGREEMENT: f32 = 0.5;
/// So many pairs of scans tell that a laser is not level.
const ENOUGH_PAIRS: u32 = 4;
/// How fast the mean agreement follows.
const FOLLOWING: f32 = 0.15;
/// A mount counts as level when its scanning plane is this near to horizontal (cosine of 25 degrees).
const LEVEL: f64 = 0.906;

/// The motion of a laser that sits like this, of a base that has moved.
fn motion(sense: Sense, base_from_laser: &Pose2, moved: &Pose2) -> Pose2 {
    let turned = |yaw_rad: f64| {
        let base_from_laser = *base_from_laser * Pose2::new(0.0, 0.0, yaw_rad);
        base_from_laser.inverse() * *moved * base_from_laser
    };
    let mirrored = |motion: Pose2| Pose2::new(motion.x_m, -motion.y_m, -motion.theta_rad);
    match sense {
        Sense::AsMounted => turned(0.0),
        Sense::TurnsReversed => mirrored(turned(0.0)),
        Sense::Backwards => turned(PI),
        Sense::BothReversed => mirrored(turned(PI)),
        Sense::Leftwards => turned(FRAC_PI_2),
        Sense::Rightwards => turned(-FRAC_PI_2),
        Sense::Still => Pose2::IDENTITY,
    }
}

/// Where a level laser sits, seen from above.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct LevelMount {
    /// The laser in the base; of a laser on its back that of its mirror image.
    pub base_from_laser: Pose2,
    /// Whether it lies on its back.
    pub mirrored: bool,
}

impl LevelMount {
    /// Of a mount; `None` when its scans are not nearly level.
    #[must_use]
    pub(crate) fn of(mount: &Mount) -> Option<Self> {
        let matrix = mount.matrix();
        let yaw_rad = matrix[1][0].portable_atan2(matrix[0][0]);
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
pub(crate) struct SenseWatch {
    /// Only what is seen while the base turns by so much counts, radians.
    min_turn_rad: f64,
    key: Option<Key>,
    vote_counts: [VoteCount; Sense::OTHERS.len()],
    /// The mean agreement of each of the others.
    means: [f32; Sense::OTHERS.len()],
    /// The mean agreement of [`Sense::AsMounted`], of so many pairs of scans.
    as_mounted: (f32, u32),
}

impl SenseWatch {
    /// Of a laser whose scans are not level if the rig is right. While it drives straight on, a fan that
    /// stands upright along its way sees what is ahead come nearer, as a level one does: only in turns are
    /// they told apart.
    #[must_use]
    pub(crate) fn in_turns() -> Self {
        Self { min_turn_rad: TURN_RAD, ..Self::default() }
    }

    /// Whether the base has moved far enough for another scan to be of interest.
    #[must_use]
    pub(crate) fn wants(&self, odom_from_base: &Pose2) -> bool {
        self.key
            .as_ref()
            .is_none_or(|key| has_moved(&key.odom_from_base.between(odom_from_base), STEP_M, STEP_RAD))
    }

    /// A scan that was wanted, of a laser that should sit like this.
    pub(crate) fn see(
        &mut self,
        stamp_ns: i64,
        profile: Profile,
        odom_from_base: Pose2,
        base_from_laser: &Pose2,
    ) {
        let now = Key { stamp_ns, profile, odom_from_base };
        if let Some(before) = &self.key {
            let moved = before.odom_from_base.between(&odom_from_base);
            let apart_ns = stamp_ns.saturating_sub(before.stamp_ns);
            let is_turn = moved.theta_rad.abs() >= self.min_turn_rad;
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

    fn vote(&mut self, Agreements { as_mounted, others }: Agreements) {
        let (mean, pairs) = &mut self.as_mounted;
        *pairs = pairs.saturating_add(1);
        let following = FOLLOWING.max(1.0 / *pairs as f32);
        *mean += following * (as_mounted - *mean);
        for (place, other) in others.into_iter().enumerate() {
            let Some(other) = other else { continue };
            self.vote_counts[place].vote(other - as_mounted, MIN_LEAD);
            self.means[place] += following * (other - self.means[place]);
        }
    }

    /// Whether the scans have been seen often enough not to move as those of a level laser.
    #[must_use]
    pub(crate) fn is_surely_none(&self) -> bool {
        let (mean, pairs) = self.as_mounted;
        pairs >= ENOUGH_PAIRS && mean < MIN_AGREEMENT
    }

    /// How the scans move; `None` while that cannot be told.
    #[must_use]
    pub(crate) fn verdict(&self) -> Option<Sense> {
        let others = Sense::OTHERS.into_iter().zip(self.vote_counts).zip(self.means);
        let best = others
            .filter(|((_, vote_count), mean)| {
                vote_count.is_won() && *mean >= MIN_AGREEMENT.max(self.as_mounted.0)
            })
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some(((sense, _), _)) = best {
            return Some(sense);
        }
        // The last one is the hardest to tell from driving.
        self.vote_counts.last().is_some_and(VoteCount::is_lost).then_some(Sense::AsMounted)
    }
}

fn has_moved(motion: &Pose2, step_m: f64, step_rad: f64) -> bool {
    let driven_m2 = motion.x_m * motion.x_m + motion.y_m * motion.y_m;
    driven_m2 >= step_m * step_m || motion.theta_rad.abs() >= step_rad
}

/// How well a scan agrees with an earlier one, 0 to 1, by how the laser may sit.
#[derive(Copy, Clone, Debug)]
struct Agreements {
    /// If it sits as the rig has it.
    as_mounted: f32,
    /// For each of [`Sense::OTHERS`], where that can be told.
    others: [Option<f32>; Sense::OTHERS.len()],
}

/// How well a scan agrees with an earlier one for each way that the laser may sit.
fn agreements(before: &Key, now: &Key, base_from_laser: &Pose2, moved: &Pose2) -> Option<Agreements> {
    let points = before.profile.points();
    let agreement = |sense: Sense| {
        let motion = motion(sense, base_from_laser, moved);
        now.profile.agreement(&points, &motion.inverse())
    };
    Some(Agreements { as_mounted: agreement(Sense::AsMounted)?, others: Sense::OTHERS.map(agreement) })
}
