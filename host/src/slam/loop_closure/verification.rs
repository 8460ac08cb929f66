//! From the cell that a search found to a loop: points on surfaces, then the questions that a true loop
//! answers.
//!
//! Do the points of each submap lie on the other one's surfaces? Does neither see through the other one's
//! walls? Is there a second place that looks the same? Along a bare corridor the information stays near zero,
//! so that a loop there holds only across.

use biplane_geometry::PortableMath;
use biplane_matcher::{EndPoint, Placement, PointAlignment, Pose2, Window};
use nalgebra::{Matrix3, Vector3};

use crate::slam::keyframes::submap::Submap;
use crate::slam::pose_graph::odometry_edges::with_floor;
use crate::slam::submap_alignment::{self, Approach};

/// When a match is a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineParams {
    /// Mean value of the points in the grid from which on a place is looked at, 0 to 1. Smaller: more places
    /// to judge, slower.
    pub min_score: f64,
    /// Share of the points that lie on the other's surfaces, of those that lie where the other one looked, in
    /// a window up to `narrow_m`. Smaller: more loops, more false ones.
    pub min_agreement: f64,
    /// The same in a wide window: a corridor shifted along itself reaches 0.8.
    pub min_agreement_wide: f64,
    /// The same of the points that tell where along a corridor one is. Smaller: corridors match shifted by a
    /// door.
    pub min_along: f64,
    /// So many points are needed to tell that; with fewer the loop holds only across. Smaller: noise passes
    /// for structure.
    pub along_points: usize,
    /// Share of one submap's points that the other one explains. Smaller: loops where little is common.
    pub min_overlap: f64,
    /// Windows up to this are narrow, meters. Larger: look-alikes pass.
    pub narrow_m: f64,
    /// Standard deviation that every loop has, meters: what the points have in common does not average out.
    pub floor_m: f64,
    /// The same of the heading, radians.
    pub floor_rad: f64,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            min_score: 0.45,
            min_agreement: 0.72,
            min_agreement_wide: 0.84,
            min_along: 0.6,
            along_points: 12,
            min_overlap: 0.4,
            narrow_m: 1.5,
            floor_m: 0.03,
            floor_rad: 0.005,
        }
    }
}

impl RefineParams {
    /// Whether there is enough to tell where along a corridor one is.
    pub fn constrains_along(&self, agreement: &Agreement) -> bool {
        agreement.along_points >= self.along_points
    }
}

/// A submap found in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The found submap's frame in the other one's.
    pub pose: Pose2,
    /// Inverse covariance of the pose.
    pub information: Matrix3<f64>,
    /// How well it fits.
    pub agreement: Agreement,
}

/// Looks for a submap in another one. `uncertainty_m` is how widely the place was searched before the guess
/// came about.
pub(crate) fn find(
    reference: &Submap,
    query: &Submap,
    guess: &Pose2,
    (window, uncertainty_m): (Window, f64),
    params: &RefineParams,
) -> Option<Found> {
    let peak = reference.pyramid().search(&query.few, guess, window, params.min_score)?;
    let aligned = settle(reference, query, &peak.pose);
    let weak = weakest(&reference.points);
    let agreement = Agreement::of(reference, query, &aligned.map_from_points, weak);
    let wide = uncertainty_m > params.narrow_m;
    let minimum = match (wide, window.half_m > params.narrow_m) {
        (true, true) => params.min_agreement_wide,
        (true, false) => 0.5 * (params.min_agreement + params.min_agreement_wide),
        (false, _) => params.min_agreement,
    };
    if agreement.share < minimum || agreement.overlap < params.min_overlap {
        return None;
    }
    let mut information = submap_alignment::information(&aligned);
    if !params.constrains_along(&agreement) {
        if window.half_m > params.narrow_m {
            return None; // the same corridor, perhaps, but who knows where
        }
        information = without(&information, Vector3::new(f64::from(weak[0]), f64::from(weak[1]), 0.0));
    } else if agreement.along < params.min_along {
        return None;
    } else if wide && has_rival((reference, query), &aligned.map_from_points, &agreement, weak, uncertainty_m)
    {
        return None; // what there is to see comes again: the next door, the next pillar
    }
    let information = known_with_floor(&information, params);
    Some(Found { pose: aligned.map_from_points, information, agreement })
}

/// How far along a corridor other places are looked for that look the same, meters; and how far they are from
/// this one at least.
const RIVAL_M: (f64, f64) = (12.0, 1.0);
/// So many of the likeliest are looked at.
const RIVALS: usize = 4;
/// Of the others the points that tell hardly lie on anything: their score is at most so much of this place's.
const RIVAL_SCORE: f64 = 0.5;
/// A rival's agreement is at most so much worse, and its share of points along at most so many times smaller.
pub(crate) const RIVAL_SHARE: f64 = 0.04;
/// See [`RIVAL_SHARE`].
pub(crate) const RIVAL_ALONG: f64 = 0.75;

/// Whether there is another place along the direction that is known least that looks the same: the next door,
/// the next pillar.
fn has_rival(
    (reference, query): (&Submap, &Submap),
    pose: &Pose2,
    own: &Agreement,
    weak: [f32; 2],
    uncertainty_m: f64,
) -> bool {
    let step_m = reference.pyramid().cell_m();
    let reach = (RIVAL_M.0.min(uncertainty_m) / step_m) as i64;
    let shifted = |step: i64| {
        let [x, y] = weak.map(|part| f64::from(part) * step_m * step as f64);
        Pose2::new(pose.x_m + x, pose.y_m + y, pose.theta_rad)
    };
    // Walls along the corridor fit everywhere: only what stands across tells one place from the next.
    let across = seen_from(pose, weak);
    let stands = |point: &&EndPoint| (point.normal[0] * across[0] + point.normal[1] * across[1]).abs() > 0.7;
    let informative: Vec<EndPoint> = query.points.iter().filter(stands).copied().collect();
    let scores: Vec<f64> =
        (-reach..=reach).map(|step| reference.pyramid().score(&informative, &shifted(step))).collect();
    let at =
        |step: i64| scores.get(usize::try_from(step + reach).unwrap_or(usize::MAX)).copied().unwrap_or(0.0);
    let here = (-3..=3).map(at).fold(0.0, f64::max);
    let mut peaks: Vec<i64> = (-reach..=reach)
        .filter(|step| step.abs() as f64 * step_m >= RIVAL_M.1)
        .filter(|&step| (-3..=3).all(|near| at(step + near) <= at(step)) && at(step) > RIVAL_SCORE * here)
        .collect();
    peaks.sort_by(|one, other| at(*other).total_cmp(&at(*one)));
    peaks.into_iter().take(RIVALS).any(|step| {
        let there = settle(reference, query, &shifted(step)).map_from_points;
        let rival = Agreement::of(reference, query, &there, weak);
        let away = [there.x_m - pose.x_m, there.y_m - pose.y_m];
        away[0].portable_hypot(away[1]) > 0.5 * RIVAL_M.1
            && rival.share > own.share - RIVAL_SHARE
            && rival.along > RIVAL_ALONG * own.along
            && 2 * rival.along_points >= own.along_points
    })
}

/// A direction in the axes of a pose.
fn seen_from(pose: &Pose2, [x, y]: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = pose.theta_rad.portable_sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    [cos * x + sin * y, cos * y - sin * x]
}

/// After a search: its best cell is off by up to its own side, and as much by the heading's step at the far
/// end. A larger scale: a neighboring row of doors draws, too. Fewer iterations: cheaper, and some end on the
/// way.
const AFTER_SEARCH: Approach = Approach { capture_m: 0.3, max_iterations: 8 };
/// The search's best cell holds the pose like a measurement of this standard deviation, meters, along what
/// nothing else fixes.
const CELL_M: f64 = 0.2;
/// The same of the heading, radians.
const CELL_RAD: f64 = 0.05;

fn settle(reference: &Submap, query: &Submap, pose: &Pose2) -> PointAlignment {
    let sigma = [CELL_M, CELL_M, CELL_RAD];
    submap_alignment::align(&reference.surfaces, &query.points, pose, &sigma, AFTER_SEARCH)
}

/// Information that is left when a direction is not known.
fn without(information: &Matrix3<f64>, direction: Vector3<f64>) -> Matrix3<f64> {
    let direction = direction.normalize();
    let held = information * direction;
    let along = direction.dot(&held);
    if along <= 0.0 { *information } else { information - held * held.transpose() / along }
}

/// With the floor's error on top, where nothing may be known along some direction.
fn known_with_floor(information: &Matrix3<f64>, params: &RefineParams) -> Matrix3<f64> {
    const MINIMUM: f64 = 1e-3;
    let known = information + Matrix3::identity() * MINIMUM;
    with_floor(&known, &[params.floor_m, params.floor_m, params.floor_rad])
}

/// How two submaps agree at a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Of the points that lie where the other submap looked, the share that it explains; the smaller of both
    /// ways.
    pub share: f64,
    /// The same of the points whose surfaces face along the direction that is known least: a corridor's door
    /// jambs and ends.
    pub along: f64,
    /// How many such points there are to tell.
    pub along_points: usize,
    /// Share of all points that the other submap explains; the larger of both ways.
    pub overlap: f64,
}

impl Agreement {
    /// At a pose of `query` in `reference`; `weak` is the direction known least, in the reference's axes.
    fn of(reference: &Submap, query: &Submap, pose: &Pose2, weak: [f32; 2]) -> Self {
        let back = pose.inverse();
        let turned = seen_from(pose, weak);
        let one = Tally::of(reference, &query.points, pose, weak);
        let other = Tally::of(query, &reference.points, &back, turned);
        Self {
            share: one.all.share().min(other.all.share()),
            along: one.along.share().min(other.along.share()),
            along_points: one.along.judged().min(other.along.judged()),
            overlap: one.overlap().max(other.overlap()),
        }
    }
}

/// Points of one kind, counted.
#[derive(Clone, Copy, Debug, Default)]
struct Votes {
    explained: usize,
    contradicted: usize,
}

impl Votes {
    fn judged(&self) -> usize {
        self.explained + self.contradicted
    }

    fn share(&self) -> f64 {
        self.explained as f64 / self.judged().max(1) as f64
    }
}

/// What a submap says of another one's points.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    all: Votes,
    along: Votes,
    points: usize,
}

/// A point farther from every surface than this, and not in free space, lies where nobody looked, meters.
const DISPLACED_M: f32 = 0.3;

impl Tally {
    fn of(submap: &Submap, points: &[EndPoint], pose: &Pose2, weak: [f32; 2]) -> Self {
        let placement = Placement::new(pose);
        let mut tally = Self { points: points.len(), ..Self::default() };
        for point in points {
            let point = point.placed(&placement);
            let is_along = (point.normal[0] * weak[0] + point.normal[1] * weak[1]).abs() > 0.7;
            let explained = submap.surfaces.explains(&point, submap_alignment::EXPLAINED_M as f32);
            // Beside a surface, not on it: a wall that has moved.
            let contradicted = !explained
                && (submap.free.is_free(point.at_m) || submap.surfaces.explains(&point, DISPLACED_M));
            for votes in [Some(&mut tally.all), is_along.then_some(&mut tally.along)].into_iter().flatten() {
                votes.explained += usize::from(explained);
                votes.contradicted += usize::from(contradicted);
            }
        }
        tally
    }

    fn overlap(&self) -> f64 {
        self.all.explained as f64 / self.points.max(1) as f64
    }
}

/// The direction of the plane that the points' normals say least of.
fn weakest(points: &[EndPoint]) -> [f32; 2] {
    let (mut difference, mut product) = (0.0_f32, 0.0_f32);
    for point in points {
        difference += point.normal[0] * point.normal[0] - point.normal[1] * point.normal[1];
        product += 2.0 * point.normal[0] * point.normal[1];
    }
    // Half the angle of the sum of doubled normals is the strongest direction.
    let angle = 0.5 * product.portable_atan2(difference) + std::f32::consts::FRAC_PI_2;
    [angle.portable_cos(), angle.portable_sin()]
}

#[cfg(test)]
pub(crate) mod tests {
    use biplane_matcher::{EndPoint, Pose2, Window};

    use super::{RefineParams, find};
    use crate::slam::keyframes::Node;
    use crate::slam::keyframes::keyframe_scan::KeyframeScan;
    use crate::slam::keyframes::submap::{Submap, SubmapParams};

    /// What is seen from a place of a corridor of 2.4 m along x, with recesses of 1 m at these places, each
    /// so deep.
    pub(crate) fn scan_of_corridor(at_m: f64, recesses: &[(f64, f64)]) -> KeyframeScan {
        let mut points = Vec::new();
        let mut add = |x: f64, y: f64, normal: [f32; 2]| {
            if (x - at_m).abs() < 6.0 {
                let at_m = [(x - at_m) as f32, y as f32];
                points.push(EndPoint { at_m, normal, weight: 1.0, ..EndPoint::default() });
            }
        };
        for step in -200..1000 {
            let x = 0.05 * f64::from(step);
            add(x, -1.2, [0.0, 1.0]);
            let within = recesses.iter().find(|(begin, _)| (0.0..1.0).contains(&(x - begin)));
            add(x, 1.2 + within.map_or(0.0, |(_, deep)| *deep), [0.0, -1.0]);
        }
        for (begin, deep) in recesses {
            for step in 0..(deep / 0.05) as i32 {
                let y = 1.2 + 0.05 * f64::from(step);
                add(*begin, y, [1.0, 0.0]);
                add(begin + 1.0, y, [-1.0, 0.0]);
            }
        }
        KeyframeScan { points, laser_m: [0.0; 2] }
    }

    /// The corridor, seen from 20 places 0.4 m apart.
    fn corridor(recesses: &[(f64, f64)]) -> Submap {
        let node = |at_m: f64| Node::at(Pose2::new(at_m, 0.0, 0.0), scan_of_corridor(at_m, recesses));
        let nodes: Vec<Node> = (0..20).map(|at| node(0.4 * f64::from(at))).collect();
        let poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
        Submap::new(&nodes, &poses, 0, &SubmapParams::default())
    }

    const NEXT_DOORS: [(f64, f64); 5] = [(-4.0, 0.5), (0.0, 0.5), (4.0, 0.5), (8.0, 0.5), (12.0, 0.5)];
    const ODD_ONES: [(f64, f64); 3] = [(-3.0, 0.3), (2.2, 0.9), (5.1, 0.5)];

    fn found(recesses: &[(f64, f64)], uncertainty_m: f64) -> Option<super::Found> {
        let (one, other) = (corridor(recesses), corridor(recesses));
        let window = Window { half_m: uncertainty_m.min(1.0), half_rad: 0.05 };
        find(&one, &other, &Pose2::new(0.2, -0.1, 0.0), (window, uncertainty_m), &RefineParams::default())
    }

    #[test]
    fn equal_doors_do_not_tell_where_along_a_corridor_one_is_unless_little_is_in_doubt() {
        assert!(found(&NEXT_DOORS, 20.0).is_none());
        let sure = found(&NEXT_DOORS, 1.0).unwrap();
        assert!(
            RefineParams::default().constrains_along(&sure.agreement) && sure.information[(0, 0)] > 100.0,
            "{sure:?}"
        );
    }

    #[test]
    fn doors_that_differ_tell_it_however_much_is_in_doubt() {
        let loop_ = found(&ODD_ONES, 20.0).unwrap();
        assert!(RefineParams::default().constrains_along(&loop_.agreement), "{loop_:?}");
        assert!(loop_.pose.distance_m() < 0.03 && loop_.information[(0, 0)] > 100.0, "{loop_:?}");
    }

    #[test]
    fn a_corridor_with_other_doors_is_no_loop() {
        let (one, other) =
            (corridor(&ODD_ONES), corridor(&[(-1.5, 0.9), (1.0, 0.3), (3.9, 0.9), (6.6, 0.3)]));
        let window = Window { half_m: 7.0, half_rad: 0.05 };
        let found = find(&one, &other, &Pose2::IDENTITY, (window, 20.0), &RefineParams::default());
        assert!(found.is_none(), "{found:?}");
    }
}
