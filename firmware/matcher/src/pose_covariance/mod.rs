//! How far the pose may be from the truth in the map's frame, the first pose being exact: the covariance that
//! is given out.
//!
//! The error of a pose is what the tracker's own arithmetic makes of the errors that go into it, carried
//! along linearly: the beams' noise; the odometry's, which has a share that stays the same over the whole
//! drive (wheels that are larger than thought) and one that is new every meter; and the map's. The map is
//! told apart in submaps, each learned around one place: a submap is off by the error that the pose had
//! there, and hands it on to every pose that is matched with it. So the error grows with new ground, along a
//! bare corridor with the odometry, and shrinks on coming back to old submaps.
//!
//! Errors are small motions of the whole map about its origin (x, y in meters, turn in radians): a pose that
//! is matched perfectly with a submap has just the submap's error, wherever it is. All submaps, the pose and
//! the odometry's shares have one joint covariance (as the robot and the landmarks in Smith, Self and
//! Cheeseman 1990).

mod evidence;
mod joint;

pub(crate) use evidence::Evidence;

use biplane_geometry::PortableMath;
use joint::Joint;
use nalgebra::{Matrix3, Vector3};

use crate::motion::Step;
use crate::parameter_group::parameter_group;
use crate::registration::covariance::inverse;
use crate::registration::degeneracy::Degeneracy;
use crate::registration::gauss_newton::prior::Prior;
use biplane_geometry::{Pose2, wrap_angle};

parameter_group! { "belief";
/// What the covariance of a pose takes for granted; it changes no pose. Larger: larger covariances, all of
/// them.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct PoseCovarianceParams {
    /// Standard deviation of the share by which the odometry's lengths are off over a whole drive.
    pub scale_share: f64,
    /// The same of its turns.
    pub turn_share: f64,
    /// Standard deviation of the odometry's steady turn to one side, radians per meter.
    pub drift_rad_per_m: f64,
    /// Standard deviation of the position after a meter that is new every meter, meters.
    pub way_m_per_root_m: f64,
    /// The same of the heading, radians.
    pub heading_rad_per_root_m: f64,
}
}

impl Default for PoseCovarianceParams {
    fn default() -> Self {
        Self {
            scale_share: 0.015,
            turn_share: 0.015,
            drift_rad_per_m: 0.01,
            way_m_per_root_m: 0.01,
            heading_rad_per_root_m: 0.01,
        }
    }
}

/// The odometry's lasting shares: length, turn, drift.
const ODOMETRY: usize = 0;
/// The pose.
const POSE: usize = 1;
/// The first submap.
const FIRST_SUBMAP: usize = 2;
/// Errors that are kept apart.
const BLOCKS: usize = 64;
/// Standard deviation by which half a meter of a mapped wall is off as a whole, meters: grid, ranges mixed at
/// edges, normals. It is the same for all beams that meet the piece, scan after scan. It changes covariances,
/// no pose.
const WALL_M: f64 = 0.001;
/// The same of a face that ends at edges on both sides within half a meter: a door frame, the side of a
/// cupboard. A submap has learned it from where the base was then, with the ranges mixed at its edges, so it
/// is off in that submap. It changes covariances, no pose.
const FACE_M: f64 = 0.022;
/// Standard deviation of the share by which all that the laser measures is too long or too short. The map is
/// off by that share of the distance from where it begins, straight away from there, whatever was seen how
/// often. Of 27 simulated drives 90 % of the positions lie in their ellipse of 95 % without it, and 95 %
/// with it. It changes covariances, no pose.
const LENGTHS_SHARE: f64 = 0.001;
/// A new submap begins when the base has moved this far, meters, or three times that in radians. Smaller:
/// more submaps, of which there is room for 62; when they are used up, every two become one. It changes
/// covariances, no pose.
const SUBMAP_EVERY_M: f64 = 1.0;
/// Fewer new surfaces make no submap.
const MIN_NEW_SURFELS: u32 = 20;
/// Matches closer together than this, meters or radians, tell what the one before has told.
const DUE: f64 = 0.025;

/// The joint covariance and when the last submap began.
#[derive(Clone, Debug)]
pub(crate) struct PoseCovariance {
    params: PoseCovarianceParams,
    joint: Joint,
    pending: PendingMotion,
    opened_at: Pose2,
    /// Where the last match was taken in.
    matched_at: Pose2,
    /// The map is a single scan yet.
    alone: bool,
    /// Scans that the last submap has been learned from.
    scans: f64,
    /// What the beams' own errors make of the pose's, at the last match.
    of_beams: Matrix3<f64>,
    /// What the errors of pieces of the map make of it.
    of_pieces: Matrix3<f64>,
}

impl PoseCovariance {
    /// Nothing seen, the pose exact.
    pub(crate) fn new(params: PoseCovarianceParams) -> Self {
        let shares = Vector3::new(params.scale_share, params.turn_share, params.drift_rad_per_m);
        let mut joint = Joint::new(BLOCKS);
        joint.push(&shares.component_mul(&shares));
        joint.push(&Vector3::zeros());
        Self {
            params,
            joint,
            pending: PendingMotion::default(),
            opened_at: Pose2::IDENTITY,
            matched_at: Pose2::IDENTITY,
            alone: false,
            scans: 1.0,
            of_beams: Matrix3::zeros(),
            of_pieces: Matrix3::zeros(),
        }
    }

    /// Covariance of a pose's x, y (m) and theta (rad) in the map's axes.
    pub(crate) fn covariance_at(&self, map_from_base: &Pose2) -> Matrix3<f64> {
        let here = about(map_from_base);
        let block = |a, b| self.joint.block(a, b);
        let crossed = self.pending.shares * block(ODOMETRY, POSE);
        let shares = self.pending.shares * block(ODOMETRY, ODOMETRY) * self.pending.shares.transpose();
        let moved = block(POSE, POSE) + crossed + crossed.transpose() + shares + self.pending.noise;
        let covariance = here * moved * here.transpose();
        let longer = Vector3::new(map_from_base.x_m, map_from_base.y_m, 0.0) * LENGTHS_SHARE;
        covariance + longer * longer.transpose() + Matrix3::identity() * 1e-10
    }

    /// The base has made a step.
    pub(crate) fn moved(&mut self, map_from_last: &Pose2, step: &Step) {
        let (sin, cos) = map_from_last.theta_rad.portable_sin_cos();
        let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let map_from_base = *map_from_last * step.last_from_base;
        let carry = back_from(&map_from_base) * turned;
        let Pose2 { x_m, y_m, theta_rad } = step.last_from_base;
        let path_m = step.last_from_base.distance_m();
        let p = &self.params;
        let noise = if step.measured() {
            let shares = Matrix3::new(x_m, 0.0, 0.0, y_m, 0.0, 0.0, 0.0, theta_rad, path_m);
            self.pending.shares += carry * shares;
            let [pending, heading] =
                [p.way_m_per_root_m, p.heading_rad_per_root_m].map(|each| each * each * path_m);
            Vector3::new(pending, 0.1 * pending, heading)
        } else {
            Vector3::from(step.sigma.map(|sigma| sigma * sigma))
        };
        self.pending.noise += carry * Matrix3::from_diagonal(&noise) * carry.transpose();
    }

    /// The way since the last time becomes a part of the pose's error, before that is told on.
    fn arrive(&mut self) {
        let PendingMotion { shares, noise } = std::mem::take(&mut self.pending);
        if shares != Matrix3::zeros() {
            self.joint.mix(POSE, &[(POSE, Matrix3::identity()), (ODOMETRY, shares)]);
        }
        self.joint.add_noise(POSE, &noise);
    }

    /// The first scan has begun the map.
    pub(crate) fn begun(&mut self, map_from_base: &Pose2) {
        self.arrive();
        self.joint.copy(POSE);
        (self.opened_at, self.alone) = (*map_from_base, true);
    }

    /// Whether the base has come so far since the last match that was taken in that the next one tells more.
    pub(crate) fn is_due(&self, map_from_base: &Pose2) -> bool {
        let step = self.matched_at.between(map_from_base);
        self.alone || step.distance_m() > DUE || step.theta_rad.abs() > DUE
    }

    /// A scan was matched: the pose is now a mixture of where the prior expected it and of where the submaps
    /// put it.
    pub(crate) fn matched(
        &mut self,
        (evidence, degeneracy): (&Evidence, &Degeneracy),
        prior: &Prior,
        map_from_base: &Pose2,
    ) {
        let prior_information = prior.information_at(map_from_base);
        let Some(spread) = inverse(&(prior_information + degeneracy.information())) else { return };
        self.arrive();
        let (here, back) = (about(map_from_base), back_from(map_from_base));
        let mut parts = [(POSE, Matrix3::identity()); evidence::PARTS + 1];
        let mut kept = Matrix3::identity();
        for (part, (submap, information)) in parts[1..].iter_mut().zip(evidence.parts()) {
            let share = back * spread * degeneracy.trusted(information) * here;
            kept -= share;
            *part = (FIRST_SUBMAP + usize::from(*submap), share);
        }
        parts[0].1 = kept;
        self.matched_at = *map_from_base;
        let gain = back * spread;
        let becomes = |pulls: &Matrix3<f64>| {
            gain * degeneracy.trusted(&degeneracy.trusted(pulls).transpose()) * gain.transpose()
        };
        let [walls, faces] = &evidence.common;
        let of_walls = becomes(walls) * (WALL_M * WALL_M);
        self.of_beams = becomes(&evidence.noise);
        self.of_pieces = of_walls + becomes(faces) * (FACE_M * FACE_M);
        let noise = self.of_beams + of_walls;
        if std::mem::take(&mut self.alone) {
            // The scan that the map was begun with was no better than this one, and its pieces are off.
            self.joint.add_noise(FIRST_SUBMAP, &(self.of_beams + self.of_pieces));
        }
        self.joint.mix(POSE, &parts[..=evidence.parts().len()]);
        self.joint.add_noise(POSE, &noise);
    }

    /// The map has learned from a scan at this pose: what is new in it is off by the mean of the submap's
    /// poses.
    pub(crate) fn learned(&mut self) {
        let submap = self.joint.used() - 1;
        if submap >= FIRST_SUBMAP {
            self.arrive();
            self.scans += 1.0;
            let new = Matrix3::identity() / self.scans;
            self.joint.mix(submap, &[(submap, Matrix3::identity() - new), (POSE, new)]);
        }
    }

    /// A reference scan was taken at the pose, in place of an older one of the same number.
    pub(crate) fn refresh(&mut self, submap: u8) {
        self.arrive();
        let block = FIRST_SUBMAP + usize::from(submap);
        if block < self.joint.used() {
            self.joint.mix(block, &[(POSE, Matrix3::identity())]);
        } else {
            self.joint.copy(POSE);
        }
    }

    /// Begins a submap at this pose when it is time to; `born` surfaces have come since the last one did.
    /// Answers with the submap, and whether every two earlier ones have become one.
    pub(crate) fn open(&mut self, map_from_base: &Pose2, born: u32) -> Option<(u8, bool)> {
        let step = self.opened_at.between(map_from_base);
        let far_m = step.distance_m().max(wrap_angle(step.theta_rad).abs() / 3.0);
        if far_m < SUBMAP_EVERY_M || born < MIN_NEW_SURFELS {
            return None;
        }
        self.arrive();
        if self.joint.used() > FIRST_SUBMAP {
            let last = self.joint.used() - 1;
            // The beams' own errors have become less in the submap that ends, scan by scan; those of pieces
            // have not. The first submap has had them from its first match on.
            let pieces = if last > FIRST_SUBMAP { self.of_pieces } else { Matrix3::zeros() };
            self.joint.add_noise(last, &(self.of_beams / self.scans + pieces));
        }
        let thinned = self.joint.used() == self.joint.capacity();
        if thinned {
            self.joint.thin(FIRST_SUBMAP);
        }
        let submap = self.joint.copy(POSE)?;
        (self.opened_at, self.scans) = (*map_from_base, 1.0);
        u8::try_from(submap - FIRST_SUBMAP).ok().map(|submap| (submap, thinned))
    }
}

/// What the steps since the pose's error was last told on add to it. They simply add up: only the pose has to
/// do with them, and all errors are about the map's origin.
#[derive(Copy, Clone, Debug, Default)]
struct PendingMotion {
    /// What the odometry's lasting shares make of it.
    shares: Matrix3<f64>,
    /// Covariance of what is new.
    noise: Matrix3<f64>,
}

/// From a motion of the map about its origin to that of a pose.
fn about(pose: &Pose2) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -pose.y_m, 0.0, 1.0, pose.x_m, 0.0, 0.0, 1.0)
}

/// The other way round.
fn back_from(pose: &Pose2) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, pose.y_m, 0.0, 1.0, -pose.x_m, 0.0, 0.0, 1.0)
}
