//! From the cell that a search found to a loop: points on surfaces, then the questions that a true loop
//! answers.
//!
//! Do the points of each submap lie on the other one's surfaces? Does neither see through the other one's
//! walls? Is there a second place that looks the same? Along a bare corridor the information stays near zero,
//! so that a loop there holds only across.

use biplane_geometry::PortableMath;
use biplane_matcher::{EndPoint, PointAlignment, Pose2};
use nalgebra::{Matrix3, Vector3};

use crate::slam::keyframes::submap::Submap;
use crate::slam::loop_closure::agreement::{Agreement, seen_from};
use crate::slam::loop_closure::search_region::{SearchRegion, smallest};
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
    /// The same in a wide window: at one of its many places few of them lie on something by chance. Smaller:
    /// more loops, more false ones. Larger: the way back along a corridor is not found, as it shows other
    /// faces than the way there.
    pub along_points_wide: usize,
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
            min_agreement_wide: 0.87,
            min_along: 0.7,
            along_points: 12,
            along_points_wide: 30,
            min_overlap: 0.4,
            narrow_m: 1.5,
            floor_m: 0.03,
            floor_rad: 0.005,
        }
    }
}

impl RefineParams {
    /// Whether there is enough to tell where along a corridor one is, of all places in a window so wide.
    pub fn constrains_along(&self, agreement: &Agreement, searched_m: f64) -> bool {
        let wide = searched_m > self.narrow_m;
        agreement.along_points >= if wide { self.along_points_wide } else { self.along_points }
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

/// Looks for a submap in another one.
pub(crate) fn find(
    reference: &Submap,
    query: &Submap,
    region: &SearchRegion,
    params: &RefineParams,
) -> Option<Found> {
    let &SearchRegion { window, uncertainty_m, .. } = region;
    let Best { aligned, weak, agreement } = best_of(reference, query, region, params.min_score)?;
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
    if !params.constrains_along(&agreement, uncertainty_m) {
        if window.half_m > params.narrow_m {
            return None; // the same corridor, perhaps, but who knows where
        }
        information = without_weakest(&information);
    } else if agreement.along < params.min_along {
        return None;
    } else if wide && has_rival((reference, query), &aligned.map_from_points, &agreement, weak, uncertainty_m)
    {
        return None; // what there is to see comes again: the next door, the next pillar
    }
    let information = known_with_floor(&information, params);
    Some(Found { pose: aligned.map_from_points, information, agreement })
}

/// The best place of a region for a submap in another one.
pub(crate) struct Best {
    aligned: PointAlignment,
    /// The direction of the other one that is known least.
    weak: [f32; 2],
    /// How well it fits there.
    pub agreement: Agreement,
}

/// The best place of a region, however bad that is, if the points' mean value in the grid is at least so much
/// there.
pub(crate) fn best_of(
    reference: &Submap,
    query: &Submap,
    region: &SearchRegion,
    min_score: f64,
) -> Option<Best> {
    let SearchRegion { guess, window, strip, .. } = region;
    let peak = reference.pyramid().search(&query.few, guess, (*window, *strip), min_score)?;
    let aligned = settle(reference, query, &peak.pose);
    let weak = weakest(&reference.points);
    let agreement = Agreement::of(reference, query, &aligned.map_from_points, weak);
    Some(Best { aligned, weak, agreement })
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

/// What counts as nothing known along a direction, as a share of all that is known.
const NOTHING_SHARE: f64 = 1e-6;

/// Information that is left when the direction that is known least is not known at all. Any other direction,
/// off by a degree, would take what is known across a corridor with it.
fn without_weakest(information: &Matrix3<f64>) -> Matrix3<f64> {
    let ([x, y], _) = smallest(information);
    let direction = Vector3::new(x, y, 0.0);
    let held = information * direction;
    // Where nothing at all is known along it, its rounding errors are no direction.
    let along = direction.dot(&held) + NOTHING_SHARE * (information[(0, 0)] + information[(1, 1)]);
    if along <= 0.0 { *information } else { information - held * held.transpose() / along }
}

/// With the floor's error on top, where nothing may be known along some direction.
fn known_with_floor(information: &Matrix3<f64>, params: &RefineParams) -> Matrix3<f64> {
    const MINIMUM: f64 = 1e-3;
    let known = information + Matrix3::identity() * MINIMUM;
    with_floor(&known, &[params.floor_m, params.floor_m, params.floor_rad])
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

    use super::{RefineParams, SearchRegion, find};
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
        let region = SearchRegion::square(Pose2::new(0.2, -0.1, 0.0), window, uncertainty_m);
        find(&one, &other, &region, &RefineParams::default())
    }

    #[test]
    fn equal_doors_do_not_tell_where_along_a_corridor_one_is_unless_little_is_in_doubt() {
        assert!(found(&NEXT_DOORS, 20.0).is_none());
        let sure = found(&NEXT_DOORS, 1.0).unwrap();
        assert!(
            RefineParams::default().constrains_along(&sure.agreement, 1.0)
                && sure.information[(0, 0)] > 100.0,
            "{sure:?}"
        );
    }

    #[test]
    fn doors_that_differ_tell_it_however_much_is_in_doubt() {
        let loop_ = found(&ODD_ONES, 20.0).unwrap();
        assert!(RefineParams::default().constrains_along(&loop_.agreement, 20.0), "{loop_:?}");
        assert!(loop_.pose.distance_m() < 0.03 && loop_.information[(0, 0)] > 100.0, "{loop_:?}");
    }

    #[test]
    fn a_corridor_with_other_doors_is_no_loop() {
        let (one, other) =
            (corridor(&ODD_ONES), corridor(&[(-1.5, 0.9), (1.0, 0.3), (3.9, 0.9), (6.6, 0.3)]));
        let window = Window { half_m: 7.0, half_rad: 0.05 };
        let region = SearchRegion::square(Pose2::IDENTITY, window, 20.0);
        let found = find(&one, &other, &region, &RefineParams::default());
        assert!(found.is_none(), "{found:?}");
    }

    /// A corridor as one line a side: recesses of 1 m in one wall, edges and pilasters (40 cm) out of the
    /// other one.
    fn walls(recesses: &[(f64, f64)], edges: &[f64], pilasters: &[f64]) -> [Vec<[f64; 2]>; 2] {
        let recess = |&(begin, deep): &(f64, f64)| {
            [[begin, 1.2], [begin, 1.2 + deep], [begin + 1.0, 1.2 + deep], [begin + 1.0, 1.2]]
        };
        let edge = |&at: &f64| [[at - 0.5, -1.2], [at, -0.7], [at + 0.5, -1.2]];
        let pilaster = |&at: &f64| [[at, -1.2], [at, -0.95], [at + 0.4, -0.95], [at + 0.4, -1.2]];
        let whole = |wall: Vec<[f64; 2]>, y: f64| [vec![[-30.0, y]], wall, vec![[60.0, y]]].concat();
        let mut out: Vec<Vec<[f64; 2]>> = edges.iter().map(|at| edge(at).to_vec()).collect();
        out.extend(pilasters.iter().map(|at| pilaster(at).to_vec()));
        out.sort_by(|one, other| one[0][0].total_cmp(&other[0][0]));
        [whole(recesses.iter().flat_map(recess).collect(), 1.2), whole(out.concat(), -1.2)]
    }

    /// What a laser sees that looks half around, up to 8 m, at a place of the corridor's middle: a beam each
    /// half degree.
    fn seen_ahead(at_m: f64, heading_rad: f64, walls: &[Vec<[f64; 2]>]) -> KeyframeScan {
        let beam = |step: i32| {
            let (sin, cos) = (0.5 * f64::from(step)).to_radians().sin_cos();
            let (turn_sin, turn_cos) = heading_rad.sin_cos();
            let towards = [turn_cos * cos - turn_sin * sin, turn_sin * cos + turn_cos * sin];
            let hit = |ends: &[[f64; 2]]| {
                let ([x, y], wall) = (ends[0], [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]]);
                let crossed = towards[0] * wall[1] - towards[1] * wall[0];
                let range_m = ((x - at_m) * wall[1] - y * wall[0]) / crossed;
                let share = ((x - at_m) * towards[1] - y * towards[0]) / crossed;
                let facing = -crossed.signum() / wall[0].hypot(wall[1]);
                let normal = [facing * wall[1], -facing * wall[0]];
                // As the base sees it.
                let normal = [
                    turn_cos * normal[0] + turn_sin * normal[1],
                    turn_cos * normal[1] - turn_sin * normal[0],
                ];
                let is_hit = range_m > 0.0 && range_m < 8.0 && (0.0..1.0).contains(&share);
                is_hit.then_some((range_m, normal))
            };
            let hits = walls.iter().flat_map(|wall| wall.windows(2).filter_map(hit));
            let (range_m, normal) = hits.min_by(|one, other| one.0.total_cmp(&other.0))?;
            let at_m = [(range_m * cos) as f32, (range_m * sin) as f32];
            let normal = normal.map(|part| part as f32);
            Some(EndPoint { at_m, normal, weight: 1.0, ..EndPoint::default() })
        };
        KeyframeScan { points: (-180..=180).filter_map(beam).collect(), laser_m: [0.0; 2] }
    }

    #[test]
    fn a_loop_of_bare_corridor_holds_across_it_and_not_along_it() {
        let found = found(&[], 1.0).unwrap();
        assert!(!RefineParams::default().constrains_along(&found.agreement, 1.0), "{found:?}");
        assert!(found.information[(1, 1)] > 100.0 && found.information[(0, 0)] < 1.0, "{found:?}");
    }

    #[test]
    fn who_comes_back_the_other_way_does_not_miss_what_only_the_way_there_shows() {
        let walls = walls(&ODD_ONES, &[0.4, 3.1, 8.2], &[-0.81, 1.59, 4.39, 5.39, 6.79]);
        let drive = |heading_rad: f64, places: [f64; 2]| {
            let node = |step: usize| {
                let at_m = places[0] + (places[1] - places[0]) * step as f64 / 19.0;
                Node::at(Pose2::new(at_m, 0.0, heading_rad), seen_ahead(at_m, heading_rad, &walls))
            };
            let nodes: Vec<Node> = (0..20).map(node).collect();
            let poses: Vec<Pose2> = nodes.iter().map(|node| node.recorded).collect();
            Submap::new(&nodes, &poses, 0, &SubmapParams::default())
        };
        let half_turn = std::f64::consts::PI;
        let (there, back) = (drive(0.0, [0.0, 7.6]), drive(half_turn, [7.6, 0.0]));
        let window = Window { half_m: 1.0, half_rad: 0.05 };
        let region = SearchRegion::square(Pose2::new(-0.1, 0.1, half_turn), window, 1.0);
        let found = find(&there, &back, &region, &RefineParams::default()).unwrap();
        // The middles are at 4.0 and 3.6 m.
        assert!((found.pose.x_m + 0.4).abs() < 0.03 && found.pose.y_m.abs() < 0.03, "{found:?}");
        assert!(RefineParams::default().constrains_along(&found.agreement, 1.0), "{found:?}");
        assert!(found.agreement.along > 0.95 && found.agreement.share > 0.98, "{found:?}");
    }
}
