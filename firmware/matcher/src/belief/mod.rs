//! How far the pose may be from the truth in the map's frame, the first pose being exact: the covariance that is given out.
//!
//! The error of a pose is what the tracker's own arithmetic makes of the errors that go into it, carried along linearly:
//! the beams' noise; the odometry's, which has a share that stays the same over the whole drive (wheels that are larger than
//! thought) and one that is new every metre; and the map's. The map is told apart in chapters, each learnt around one
//! place: a chapter is off by the error that the pose had there, and hands it on to every pose that is matched with it. So
//! the error grows with new ground, along a bare corridor with the odometry, and shrinks on coming back to old chapters.
//!
//! Errors are small motions of the whole map about its origin (x, y in metres, turn in radians): a pose that is matched
//! perfectly with a chapter has just the chapter's error, wherever it is. All chapters, the pose and the odometry's
//! shares have one joint covariance (as the robot and the landmarks in Smith, Self and Cheeseman 1990).

mod evidence;
mod joint;

pub use evidence::Evidence;

use joint::Joint;
use nalgebra::{Matrix3, Vector3};

use crate::align::Prior;
use crate::covariance::inverse;
use crate::doubt::Doubt;
use crate::motion::Step;
use crate::pose::{Pose2, wrap_angle};

crate::named::named_parameters! { "belief";
/// What the covariance of a pose takes for granted; it changes no pose. Larger: larger covariances, all of them.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct BeliefParams {
    /// Standard deviation of the share by which the odometry's lengths are off over a whole drive.
    pub scale_share: f64,
    /// The same of its turns.
    pub turn_share: f64,
    /// Standard deviation of the odometry's steady turn to one side, radians per metre.
    pub drift_rad_per_m: f64,
    /// Standard deviation of the position after a metre that is new every metre, metres.
    pub way_m_per_root_m: f64,
    /// The same of the heading, radians.
    pub heading_rad_per_root_m: f64,
    /// Standard deviation by which half a metre of a mapped wall is off as a whole, metres: grid, ranges
    /// mixed at edges, normals. It is the same for all beams that meet the piece, scan after scan.
    pub wall_m: f64,
    /// The same of a face that ends at edges on both sides within half a metre: a door frame, the side of a cupboard.
    pub face_m: f64,
    /// A new chapter begins when the base has moved this far, metres, or three times that in radians. Smaller: more chapters,
    /// of which there is room for 62; when they are used up, every two become one.
    pub chapter_every_m: f64 [0.05, 1000.0],
}
}

impl Default for BeliefParams {
    fn default() -> Self {
        Self {
            scale_share: 0.015,
            turn_share: 0.015,
            drift_rad_per_m: 0.01,
            way_m_per_root_m: 0.01,
            heading_rad_per_root_m: 0.01,
            wall_m: 0.001,
            face_m: 0.011,
            chapter_every_m: 1.0,
        }
    }
}

/// The odometry's lasting shares: length, turn, drift.
const ODOMETRY: usize = 0;
/// The pose.
const POSE: usize = 1;
/// The first chapter.
const CHAPTERS: usize = 2;
/// Errors that are kept apart.
const BLOCKS: usize = 64;
/// Fewer new surfaces make no chapter.
const NEW_SURFACES: u32 = 20;
/// Matches closer together than this, metres or radians, tell what the one before has told.
const DUE: f64 = 0.025;

/// The joint covariance and when the last chapter began.
#[derive(Clone, Debug)]
pub struct Belief {
    params: BeliefParams,
    joint: Joint,
    way: Way,
    opened_at: Pose2,
    /// Where the last match was taken in.
    matched_at: Pose2,
    /// The map is a single scan yet.
    alone: bool,
    /// Scans that the last chapter has been learnt from.
    scans: f64,
    /// What the pieces' errors make of the pose's, at the last match.
    common: Matrix3<f64>,
}

impl Belief {
    /// Nothing seen, the pose exact.
    pub fn new(params: BeliefParams) -> Self {
        let shares = Vector3::new(params.scale_share, params.turn_share, params.drift_rad_per_m);
        let mut joint = Joint::new(BLOCKS);
        joint.push(&shares.component_mul(&shares));
        joint.push(&Vector3::zeros());
        Self {
            params,
            joint,
            way: Way::default(),
            opened_at: Pose2::IDENTITY,
            matched_at: Pose2::IDENTITY,
            alone: false,
            scans: 1.0,
            common: Matrix3::zeros(),
        }
    }

    /// Covariance of a pose's x, y (m) and theta (rad) in the map's axes.
    pub fn covariance_at(&self, map_from_base: &Pose2) -> Matrix3<f64> {
        let here = about(map_from_base);
        let block = |a, b| self.joint.block(a, b);
        let crossed = self.way.shares * block(ODOMETRY, POSE);
        let shares = self.way.shares * block(ODOMETRY, ODOMETRY) * self.way.shares.transpose();
        let moved = block(POSE, POSE) + crossed + crossed.transpose() + shares + self.way.noise;
        let covariance = here * moved * here.transpose();
        covariance + Matrix3::identity() * 1e-10
    }

    /// The base has made a step.
    pub fn moved(&mut self, map_from_last: &Pose2, step: &Step) {
        let (sin, cos) = map_from_last.theta_rad.sin_cos();
        let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let map_from_base = *map_from_last * step.last_from_base;
        let carry = back_from(&map_from_base) * turned;
        let Pose2 { x_m, y_m, theta_rad } = step.last_from_base;
        let way_m = step.last_from_base.distance_m();
        let p = &self.params;
        let noise = if step.measured() {
            let shares = Matrix3::new(x_m, 0.0, 0.0, y_m, 0.0, 0.0, 0.0, theta_rad, way_m);
            self.way.shares += carry * shares;
            let [way, heading] =
                [p.way_m_per_root_m, p.heading_rad_per_root_m].map(|each| each * each * way_m);
            Vector3::new(way, 0.1 * way, heading)
        } else {
            Vector3::from(step.sigma.map(|sigma| sigma * sigma))
        };
        self.way.noise += carry * Matrix3::from_diagonal(&noise) * carry.transpose();
    }

    /// The way since the last time becomes a part of the pose's error, before that is told on.
    fn arrive(&mut self) {
        let Way { shares, noise } = std::mem::take(&mut self.way);
        if shares != Matrix3::zeros() {
            self.joint.mix(POSE, &[(POSE, Matrix3::identity()), (ODOMETRY, shares)]);
        }
        self.joint.add_noise(POSE, &noise);
    }

    /// The first scan has begun the map.
    pub fn begun(&mut self, map_from_base: &Pose2) {
        self.arrive();
        self.joint.copy(POSE);
        (self.opened_at, self.alone) = (*map_from_base, true);
    }

    /// Whether the base has come so far since the last match that was taken in that the next one tells more.
    pub fn is_due(&self, map_from_base: &Pose2) -> bool {
        let step = self.matched_at.between(map_from_base);
        self.alone || step.distance_m() > DUE || step.theta_rad.abs() > DUE
    }

    /// A scan was matched: the pose is now a mixture of where the prior expected it and of where the chapters put it.
    pub fn matched(&mut self, (evidence, doubt): (&Evidence, &Doubt), prior: &Prior, map_from_base: &Pose2) {
        let held = prior.information_at(map_from_base);
        let Some(spread) = inverse(&(held + doubt.information())) else { return };
        self.arrive();
        let (here, back) = (about(map_from_base), back_from(map_from_base));
        let mut parts = [(POSE, Matrix3::identity()); evidence::PARTS + 1];
        let mut kept = Matrix3::identity();
        for (part, (chapter, information)) in parts[1..].iter_mut().zip(evidence.parts()) {
            let share = back * spread * doubt.believed(information) * here;
            kept -= share;
            *part = (CHAPTERS + usize::from(*chapter), share);
        }
        parts[0].1 = kept;
        self.matched_at = *map_from_base;
        let gain = back * spread;
        let becomes = |pulls: &Matrix3<f64>| {
            gain * doubt.believed(&doubt.believed(pulls).transpose()) * gain.transpose()
        };
        let [walls, faces] = &evidence.common;
        let [wall_m, face_m] = [self.params.wall_m, self.params.face_m];
        self.common = becomes(walls) * (wall_m * wall_m) + becomes(faces) * (face_m * face_m);
        let noise = becomes(&evidence.noise) + self.common;
        if std::mem::take(&mut self.alone) {
            // The scan that the map was begun with was no better than this one.
            self.joint.add_noise(CHAPTERS, &noise);
        }
        self.joint.mix(POSE, &parts[..=evidence.parts().len()]);
        self.joint.add_noise(POSE, &noise);
    }

    /// The map has learnt from a scan at this pose: what is new in it is off by the mean of the chapter's poses.
    pub fn learnt(&mut self) {
        let chapter = self.joint.used() - 1;
        if chapter >= CHAPTERS {
            self.arrive();
            self.scans += 1.0;
            let new = Matrix3::identity() / self.scans;
            self.joint.mix(chapter, &[(chapter, Matrix3::identity() - new), (POSE, new)]);
        }
    }

    /// A reference scan was taken at the pose, in place of an older one of the same number.
    pub fn refresh(&mut self, chapter: u8) {
        self.arrive();
        let block = CHAPTERS + usize::from(chapter);
        if block < self.joint.used() {
            self.joint.mix(block, &[(POSE, Matrix3::identity())]);
        } else {
            self.joint.copy(POSE);
        }
    }

    /// Begins a chapter at this pose when it is time to; `born` surfaces have come since the last one did. Answers with the
    /// chapter, and whether every two earlier ones have become one.
    pub fn open(&mut self, map_from_base: &Pose2, born: u32) -> Option<(u8, bool)> {
        let step = self.opened_at.between(map_from_base);
        let far_m = step.distance_m().max(wrap_angle(step.theta_rad).abs() / 3.0);
        if far_m < self.params.chapter_every_m || born < NEW_SURFACES {
            return None;
        }
        self.arrive();
        if self.joint.used() > CHAPTERS {
            // The beams' own errors have become less in the chapter that ends, scan by scan; these have not.
            self.joint.add_noise(self.joint.used() - 1, &self.common);
        }
        let thinned = self.joint.used() == self.joint.capacity();
        if thinned {
            self.joint.thin(CHAPTERS);
        }
        let chapter = self.joint.copy(POSE)?;
        (self.opened_at, self.scans) = (*map_from_base, 1.0);
        u8::try_from(chapter - CHAPTERS).ok().map(|chapter| (chapter, thinned))
    }
}

/// What the steps since the pose's error was last told on add to it. They simply add up: only the pose has to do with
/// them, and all errors are about the map's origin.
#[derive(Copy, Clone, Debug, Default)]
struct Way {
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
