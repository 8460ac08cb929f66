//! The relations metric (Kümmerle et al. 2009, "On measuring the accuracy of SLAM algorithms"): how well a
//! trajectory agrees with relative poses that people checked by hand.
//!
//! A relation is the pose of the robot at one time as seen from its pose at another. The error of each is the
//! distance between the true and the estimated relative position (meters) and the angle between both
//! headings, so no alignment is needed and an error made once does not count again in all later poses.

use biplane_geometry::PortableMath;
use std::io::{self, BufRead};

use biplane_matcher::{Pose2, wrap_angle};
use serde::Serialize;

use super::statistics::MeanSpread;
use crate::recordings::deskew::StampedPose;
use crate::recordings::stamp_text::parse_seconds_ns;

const NS_PER_S: f64 = 1e9;

/// The pose of the base at one time in its frame at another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation {
    /// Time of the pose that it is seen from, nanoseconds.
    pub stamp_a_ns: i64,
    /// Time of the pose that is seen, nanoseconds.
    pub stamp_b_ns: i64,
    /// Where the second pose is.
    pub b_in_a: Pose2,
    /// Its height, meters: zero on a floor, counted in full as error elsewhere.
    pub z_m: f64,
}

/// What is wrong in a file of relations.
#[derive(Debug, thiserror::Error)]
pub enum RelationsError {
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A line does not hold a relation.
    #[error(
        "line {line}: expected \"t1 t2 x y z roll pitch yaw\" (seconds, meters, radians), found \"{found}\""
    )]
    Line {
        /// Line number from 1.
        line: usize,
        /// The line, shortened.
        found: String,
    },
    /// No line holds a relation.
    #[error("there is no relation in it")]
    Empty,
}

/// Reads relations: one a line, `#` comments.
///
/// # Errors
/// When a line does not read as a relation, or there is none.
pub fn read_relations(input: impl BufRead) -> Result<Vec<Relation>, RelationsError> {
    let mut relations = Vec::new();
    for (index, line) in input.lines().enumerate() {
        let line = line?;
        let text = line.trim();
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let found = || text.chars().take(80).collect();
        relations
            .push(parse_line(text).ok_or_else(|| RelationsError::Line { line: index + 1, found: found() })?);
    }
    if relations.is_empty() { Err(RelationsError::Empty) } else { Ok(relations) }
}

fn parse_line(text: &str) -> Option<Relation> {
    let mut fields = text.split_whitespace();
    let mut stamp_ns = || parse_seconds_ns(fields.next()?);
    let (stamp_a_ns, stamp_b_ns) = (stamp_ns()?, stamp_ns()?);
    let values: Vec<f64> =
        fields.map(|field| field.parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<_>>()?;
    let &[x_m, y_m, z_m, _roll, _pitch, yaw_rad] = &values[..] else { return None };
    Some(Relation { stamp_a_ns, stamp_b_ns, b_in_a: Pose2::new(x_m, y_m, yaw_rad), z_m })
}

/// How relations are measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelationsParams {
    /// A pose this near in time stands for the relation's own, seconds; farther off it is interpolated.
    /// Larger takes poses of another moment as they are.
    pub max_dt_s: f64,
    /// Only relations whose times are at least this far apart, seconds. Larger leaves the places that were
    /// seen again.
    pub min_gap_s: f64,
    /// Only relations whose times are at most this far apart, seconds. Smaller leaves the accuracy from scan
    /// to scan.
    pub max_gap_s: f64,
    /// The point of the robot whose poses the relations are of, in the frame of the base, meters.
    pub about_m: [f64; 2],
}

impl Default for RelationsParams {
    fn default() -> Self {
        Self { max_dt_s: 0.1, min_gap_s: 0.0, max_gap_s: f64::INFINITY, about_m: [0.0; 2] }
    }
}

impl RelationsParams {
    fn takes(&self, relation: &Relation) -> bool {
        let gap_s = relation.stamp_a_ns.abs_diff(relation.stamp_b_ns) as f64 / NS_PER_S;
        (self.min_gap_s..=self.max_gap_s).contains(&gap_s)
    }
}

/// The error of one relation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelationError {
    /// Time of the pose that is seen from, nanoseconds.
    pub stamp_a_ns: i64,
    /// Time of the pose that is seen, nanoseconds.
    pub stamp_b_ns: i64,
    /// Distance between true and estimated relative position, meters.
    pub translation_m: f64,
    /// Angle between true and estimated relative heading, radians, never negative.
    pub rotation_rad: f64,
}

/// Where the poses of the relations' times came from; each time counts once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PosesFound {
    /// A pose of the trajectory was near enough in time.
    pub direct: usize,
    /// Interpolated between neighbors farther off.
    pub interpolated: usize,
    /// Outside of the trajectory's time: there is none.
    pub outside: usize,
    /// Relations that were left out, because one of their times is outside.
    #[serde(skip)]
    pub relations_left_out: usize,
}

/// The figures of the published tables: mean, spread and largest of the errors and of their squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelationsReport {
    /// Relations measured.
    pub relations: usize,
    /// Relations left out, because one of their times lies outside of the trajectory's.
    pub relations_left_out: usize,
    /// Where their poses came from.
    pub poses: PosesFound,
    /// Translational error, meters.
    pub translation_m: MeanSpread,
    /// Its square, square meters.
    pub translation_m2: MeanSpread,
    /// Rotational error, degrees.
    pub rotation_deg: MeanSpread,
    /// Its square, square degrees.
    pub rotation_deg2: MeanSpread,
}

/// The error of each relation that `params` takes and that lies within the time of `poses`, in the order of
/// the file, and where the poses were found. `poses` come in any order.
pub fn relation_errors(
    relations: &[Relation],
    poses: &[StampedPose],
    params: &RelationsParams,
) -> (Vec<RelationError>, PosesFound) {
    let [x_m, y_m] = params.about_m;
    let about = Pose2::new(x_m, y_m, 0.0);
    let mut finder = PoseFinder::new(poses, (params.max_dt_s * NS_PER_S) as i64);
    let errors = relations.iter().filter(|relation| params.takes(relation)).filter_map(|relation| {
        let [a, b] = finder.both([relation.stamp_a_ns, relation.stamp_b_ns])?;
        let (found, wanted) = ((a * about).between(&(b * about)), relation.b_in_a);
        let planar_m = (found.x_m - wanted.x_m).portable_hypot(found.y_m - wanted.y_m);
        Some(RelationError {
            stamp_a_ns: relation.stamp_a_ns,
            stamp_b_ns: relation.stamp_b_ns,
            translation_m: planar_m.portable_hypot(relation.z_m),
            rotation_rad: wrap_angle(found.theta_rad - wanted.theta_rad).abs(),
        })
    });
    let errors = errors.collect();
    (errors, finder.found)
}

/// The figures of these errors; `None` of none.
pub fn report(errors: &[RelationError], poses: PosesFound) -> Option<RelationsReport> {
    let of = |value: fn(&RelationError) -> f64| MeanSpread::of(&errors.iter().map(value).collect::<Vec<_>>());
    Some(RelationsReport {
        relations: errors.len(),
        relations_left_out: poses.relations_left_out,
        poses,
        translation_m: of(|e| e.translation_m)?,
        translation_m2: of(|e| e.translation_m.powi(2))?,
        rotation_deg: of(|e| e.rotation_rad.to_degrees())?,
        rotation_deg2: of(|e| e.rotation_rad.to_degrees().powi(2))?,
    })
}

/// Poses by time, as the metric wants them: the nearest, not an interpolated one, where one is near enough.
struct PoseFinder {
    poses: Vec<StampedPose>,
    max_dt_ns: i64,
    asked: std::collections::BTreeSet<i64>,
    found: PosesFound,
}

impl PoseFinder {
    fn new(poses: &[StampedPose], max_dt_ns: i64) -> Self {
        let mut poses = poses.to_vec();
        // Stable: of several poses of one time each stays at its place, the first one is met first.
        poses.sort_by_key(|pose| pose.stamp_ns);
        Self { poses, max_dt_ns, asked: std::collections::BTreeSet::new(), found: PosesFound::default() }
    }

    /// The poses of a relation's times; `None` where one is outside.
    fn both(&mut self, stamps_ns: [i64; 2]) -> Option<[Pose2; 2]> {
        let places = stamps_ns.map(|stamp_ns| self.place(stamp_ns));
        let is_left_out = places.contains(&Place::Outside);
        self.found.relations_left_out += usize::from(is_left_out);
        for (stamp_ns, place) in stamps_ns.into_iter().zip(places) {
            // What a relation that is left out has inside was not asked for.
            if (place == Place::Outside || !is_left_out) && self.asked.insert(stamp_ns) {
                *match place {
                    Place::Direct(_) => &mut self.found.direct,
                    Place::Between(_) => &mut self.found.interpolated,
                    Place::Outside => &mut self.found.outside,
                } += 1;
            }
        }
        let [a, b] = places.map(Place::pose);
        Some([a?, b?])
    }

    fn place(&self, stamp_ns: i64) -> Place {
        let after = self.poses.partition_point(|pose| pose.stamp_ns < stamp_ns);
        let next = self.poses.get(after);
        let previous = after.checked_sub(1).and_then(|index| self.poses.get(index));
        let away_ns = |pose: &&StampedPose| pose.stamp_ns.abs_diff(stamp_ns);
        let nearest = [previous, next].into_iter().flatten().min_by_key(away_ns);
        match (nearest, previous, next) {
            (Some(pose), ..) if away_ns(&pose) <= self.max_dt_ns.unsigned_abs() => Place::Direct(pose.pose()),
            (_, Some(a), Some(b)) => {
                let share = (stamp_ns - a.stamp_ns) as f64 / (b.stamp_ns - a.stamp_ns) as f64;
                Place::Between(a.pose().interpolate(&b.pose(), share))
            }
            _ => Place::Outside,
        }
    }
}

/// Where the pose of a time was found.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Direct(Pose2),
    Between(Pose2),
    Outside,
}

impl Place {
    fn pose(self) -> Option<Pose2> {
        match self {
            Self::Direct(pose) | Self::Between(pose) => Some(pose),
            Self::Outside => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::{PosesFound, RelationsParams, read_relations, relation_errors, report};
    use crate::recordings::deskew::StampedPose;

    fn pose(stamp_s: f64, x_m: f64, y_m: f64, theta_rad: f64) -> StampedPose {
        StampedPose { stamp_ns: (stamp_s * 1e9) as i64, x_m, y_m, theta_rad, ..StampedPose::default() }
    }

    #[test]
    fn the_figures_of_three_relations_are_those_worked_out_by_hand() {
        // Facing along y at (1, 0), then at (1, 2) facing along -x; then a meter on.
        let poses = [pose(0.0, 1.0, 0.0, FRAC_PI_2), pose(10.0, 1.0, 2.0, PI), pose(11.0, 0.0, 2.0, -PI)];
        let text = "# t1 t2 x y z roll pitch yaw\n\
            0 10 2 0 0 0 0 1.5707963267948966\n\
            10 11 1.03 0.04 0 0 0 0\n\
            0 11 2 1 0.5 0 0 1.5533430342749532\n";
        let relations = read_relations(text.as_bytes()).unwrap();
        let (errors, found) = relation_errors(&relations, &poses, &RelationsParams::default());
        assert_eq!(found, PosesFound { direct: 3, ..PosesFound::default() });
        for (error, (translation_m, rotation_deg)) in errors.iter().zip([(0.0, 0.0), (0.05, 0.0), (0.5, 1.0)])
        {
            assert!((error.translation_m - translation_m).abs() < 1e-12, "{error:?}");
            assert!((error.rotation_rad.to_degrees() - rotation_deg).abs() < 1e-9, "{error:?}");
        }
        let report = report(&errors, found).unwrap();
        assert!((report.translation_m.mean - 0.55 / 3.0).abs() < 1e-12);
        assert!((report.translation_m2.mean - 0.2525 / 3.0).abs() < 1e-12);
        // Of 0, 0 and 1: variance (1/9 + 1/9 + 4/9) / 2.
        assert!((report.rotation_deg.std - (1.0_f64 / 3.0).sqrt()).abs() < 1e-9);
        assert!((report.rotation_deg2.max - 1.0).abs() < 1e-9);
    }

    #[test]
    fn relations_of_another_point_of_the_robot_are_those_of_its_poses() {
        // A quarter turn on the spot: a point ahead has gone there and to the left.
        let poses = [pose(0.0, 0.0, 0.0, 0.0), pose(1.0, 0.0, 0.0, FRAC_PI_2)];
        let relations = read_relations(&b"0 1 -0.034 0.034 0 0 0 1.5707963267948966\n"[..]).unwrap();
        let of = |about_m: [f64; 2]| {
            let params = RelationsParams { about_m, ..RelationsParams::default() };
            relation_errors(&relations, &poses, &params).0[0].translation_m
        };
        assert!(of([0.034, 0.0]) < 1e-12 && of([0.0, 0.0]) > 0.04, "{} {}", of([0.034, 0.0]), of([0.0; 2]));
    }

    #[test]
    fn gaps_choose_among_the_relations() {
        let poses = [pose(0.0, 0.0, 0.0, 0.0), pose(100.0, 0.0, 0.0, 0.0)];
        let relations =
            read_relations(&b"0 5 0 0 0 0 0 0\n20 0 0 0 0 0 0 0\n0 90 0 0 0 0 0 0\n"[..]).unwrap();
        let count = |min_gap_s, max_gap_s| {
            let params = RelationsParams { min_gap_s, max_gap_s, ..RelationsParams::default() };
            relation_errors(&relations, &poses, &params).0.len()
        };
        assert_eq!([count(0.0, 20.0), count(20.0, 1e9), count(6.0, 19.0)], [2, 2, 0]);
        assert!(report(&[], PosesFound::default()).is_none());
    }

    #[test]
    fn a_pose_is_taken_as_it_is_when_near_and_interpolated_when_not_and_outside_there_is_none() {
        let poses = [pose(1.0, 1.0, 0.0, 0.0), pose(0.0, 0.0, 0.0, 0.0)];
        let relations = read_relations(&b"0.05 0.5 0.5 0 0 0 0 0\n0.95 9 0 0 0 0 0 0\n"[..]).unwrap();
        let (errors, found) = relation_errors(&relations, &poses, &RelationsParams::default());
        assert_eq!(found, PosesFound { direct: 1, interpolated: 1, outside: 1, relations_left_out: 1 });
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(errors[0].translation_m < 1e-12, "{errors:?}");
        assert_eq!(report(&errors, found).unwrap().relations_left_out, 1);
        let strict = RelationsParams { max_dt_s: 0.01, ..RelationsParams::default() };
        let (errors, found) = relation_errors(&relations, &poses, &strict);
        assert_eq!(found, PosesFound { direct: 0, interpolated: 2, outside: 1, relations_left_out: 1 });
        assert!((errors[0].translation_m - 0.05).abs() < 1e-12, "{errors:?}");
    }

    #[test]
    fn a_broken_line_is_named() {
        for broken in ["1 2 3", "1 2 0 0 0 0 0 nan", "1 2 0 0 0 0 0 0 0", "a 2 0 0 0 0 0 0"] {
            let error = read_relations(format!("\n{broken}\n").as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with("line 2: expected") && error.contains(broken), "{error}");
        }
        assert_eq!(read_relations(&b"#\n"[..]).unwrap_err().to_string(), "there is no relation in it");
    }
}
