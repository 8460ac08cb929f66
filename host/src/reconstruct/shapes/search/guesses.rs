//! Cylinders in a cluster of points, one after another: circles through a few near points, seen along likely
//! axes, are guesses; the best are fitted and judged. Meters.

use super::circle::{Circle, algebraic, through};
use super::section::{Score, Section};
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
use crate::reconstruct::shapes::fit::circle_fit;
use crate::reconstruct::shapes::fit::gauss_newton;
use crate::reconstruct::shapes::fit::judge::{Accepted, BESIDE_DEVIATIONS, judge, may_become};
use crate::reconstruct::shapes::fit::runs::longest_run;
use crate::reconstruct::shapes::fit::sample::Sample;
use crate::reconstruct::shapes::fit::surface::{Evidence, MIN_LENGTH_M, Rejected, min_length_m};
use crate::reconstruct::shapes::params::ShapeParams;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::dot;

/// Guesses for each axis: one for so many points, within bounds.
const POINTS_PER_GUESS: usize = 12;
const GUESSES: [usize; 2] = [60, 240];
/// Points among which circles are guessed; of a larger cluster so many.
const MAX_GUESS_POINTS: usize = 2500;
/// A guess needs points on it, in those that a cylinder has: so much these score with the noise of a range.
const MIN_SCORE: f64 = 0.8;
/// A guess has this share of the score that it had with all points within and near it on it. Of 325 guesses
/// that became cylinders one had less, of 37 357 others one in seven (29 clouds).
const MIN_SCORE_SHARE: f64 = 0.3;
/// The same from such a radius on: a corner of an apse is a guess too, and much lies about that.
const MIN_WIDE_SHARE: f64 = 0.15;
const WIDE_M: f64 = 0.5;
/// What lies about a guess, in radii and deviations.
const ABOUT_RADII: f64 = 1.5;
const ABOUT_DEVIATIONS: f64 = 12.0;
/// A fitted radius this much larger than the guess's has more about it than the guess had.
const GROWN: f64 = 1.2;
/// How far from its first point the others of a guess lie: from poles to stout columns.
const REACHES_M: [f64; 5] = [0.08, 0.16, 0.32, 0.64, 1.28];
/// Radii above this are left to the search among strips of planes.
const MAX_GUESSED_M: f64 = 1.2;
/// Points of a neighborhood that a guess is fitted to.
const MAX_FITTED: usize = 100;
/// Points that are asked for a score.
const MAX_ASKED: usize = 300;
/// Guesses of an axis that are fitted and judged, best first.
const KEPT: usize = 4;
/// Points within so many deviations of a guess count for it.
const GUESS_DEVIATIONS: f64 = 2.5;
/// Points within so many deviations are fitted.
const FIT_DEVIATIONS: f64 = 3.0;
/// Rough fits that are no more deviations apart are one.
const SAME_DEVIATIONS: f64 = 0.25;
/// Points that a cylinder may share with a larger one that was found with it.
const MAX_SHARED: f64 = 0.1;
/// A cylinder with so many of a cluster's points is what the cluster is.
const WHOLE_SHARE: f64 = 0.5;
/// What is so little past an end is beside a cylinder still.
const BESIDE_M: f64 = 0.1;
/// Points that a cylinder is fitted to: more cost time and change nothing.
const MAX_FIT_POINTS: usize = 2000;
/// Largest number of cylinders of one cluster.
const MAX_FOUND: usize = 64;

/// Finds the cylinders of a cluster.
pub(crate) fn all(params: &ShapeParams, seen: &Evidence<'_>, directions: &[[f64; 3]]) -> Vec<Accepted> {
    let mut left: Vec<usize> = (0..seen.points_m.len()).collect();
    let mut found: Vec<Accepted> = Vec::new();
    while left.len() >= params.min_points && found.len() < MAX_FOUND {
        let (points_m, origins_m) = (picked(seen.points_m, &left), picked(seen.origins_m, &left));
        let own = Evidence { points_m: &points_m, origins_m: &origins_m, ..*seen };
        let mut all: Vec<Accepted> = Vec::new();
        for direction in directions {
            all.extend(along(params, &own, *direction));
            // What is round along one axis is not round along another.
            if all.iter().any(|one| one.on.len() as f64 >= WHOLE_SHARE * left.len() as f64) {
                break;
            }
        }
        all.sort_by_key(|one| std::cmp::Reverse(one.on.len()));
        let before = found.len();
        let mut gone = vec![false; left.len()];
        for mut one in all {
            let shared = one.on.iter().filter(|i| gone[**i]).count();
            if shared as f64 <= MAX_SHARED * one.on.len() as f64 {
                take(&one, &own, &mut gone);
                one.on.iter_mut().for_each(|i| *i = left[*i]);
                found.push(one);
            }
        }
        if found.len() == before {
            break;
        }
        let mut gone = gone.into_iter();
        left.retain(|_| !gone.next().unwrap_or(false));
    }
    found
}

/// Those of some indices, as many as there are.
fn picked(from_m: &[[f64; 3]], indices: &[usize]) -> Vec<[f64; 3]> {
    let mut picked = Vec::with_capacity(indices.len().min(from_m.len()));
    picked.extend(indices.iter().filter_map(|i| from_m.get(*i).copied()));
    picked
}

/// Takes a cylinder's points, and those beside it, which are its noise and the mixed pixels of its edges.
fn take(one: &Accepted, seen: &Evidence<'_>, gone: &mut [bool]) {
    let [from_m, to_m] = one.along_m;
    for (point, gone) in seen.points_m.iter().zip(gone) {
        let along_m = one.tube.axis.local(*point)[2];
        let is_beside = (from_m - BESIDE_M..=to_m + BESIDE_M).contains(&along_m);
        *gone |= is_beside && one.tube.off_m(*point).abs() <= BESIDE_DEVIATIONS * seen.sigma_m;
    }
}

/// The cylinders along a direction that stand the judgment, of the best guesses.
fn along(params: &ShapeParams, seen: &Evidence<'_>, direction: [f64; 3]) -> Vec<Accepted> {
    let axis = Axis::new(seen.points_m[0], direction);
    let step = seen.points_m.len().div_ceil(MAX_GUESS_POINTS).max(1);
    let some: Vec<[f64; 3]> = seen.points_m.iter().step_by(step).copied().collect();
    let section = Section::new(&axis, &some);
    let lengths = section.points_m.iter().map(|p| p[2]);
    let (from, to) = lengths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if to - from < MIN_LENGTH_M {
        return Vec::new();
    }
    let mut tried = Vec::new();
    let accepted = |circle: Circle| {
        let start = Tube { axis: axis.through(circle.center_m), radius_m: circle.radius_m };
        refined(params, start, seen, &mut tried).ok()
    };
    guesses(params, &section, to - from, (seen.sigma_m, step as f64))
        .into_iter()
        .filter_map(accepted)
        .collect()
}

/// Circles that explain the points about them well, best first, none like another.
fn guesses(
    params: &ShapeParams,
    section: &Section,
    length_m: f64,
    (sigma_m, share): (f64, f64),
) -> Vec<Circle> {
    let count = section.points_m.len();
    let limit_m = GUESS_DEVIATIONS * sigma_m;
    let tries = (count / POINTS_PER_GUESS).clamp(GUESSES[0], GUESSES[1]);
    let mut random = Random::new(count as u64);
    let mut scored: Vec<(Score, Circle)> = Vec::new();
    let mut near_m = Vec::new();
    let usual = params.min_radius_m * 0.5..=MAX_GUESSED_M.min(params.max_radius_m);
    for number in 0..tries {
        let seed = random.below(count);
        let reach_m = REACHES_M[number % REACHES_M.len()];
        section.near(section.at_m(seed), reach_m, MAX_FITTED, &mut random, &mut near_m);
        let circle = if (number / REACHES_M.len()).is_multiple_of(2) {
            algebraic(near_m.iter().copied())
        } else {
            three(&near_m, &mut random)
        };
        let Some(circle) = circle.filter(|circle| usual.contains(&circle.radius_m)) else { continue };
        if length_m < min_length_m(circle.radius_m) {
            continue;
        }
        scored.push((section.score(&circle, limit_m, MAX_ASKED), circle));
    }
    scored.sort_by(|a, b| b.0.points.total_cmp(&a.0.points));
    let mut best: Vec<(Score, Circle)> = Vec::new();
    for (score, circle) in scored {
        let is_new = best.iter().all(|(_, other)| {
            let [x, y] = [0, 1].map(|k| circle.center_m[k] - other.center_m[k]);
            x.portable_hypot(y).max((circle.radius_m - other.radius_m).abs()) > 0.3 * other.radius_m
        });
        if is_new && score.points * share >= MIN_SCORE * params.min_points as f64 {
            best.push((score, circle));
        }
        if best.len() == KEPT {
            break;
        }
    }
    let has_share = |(score, circle): &(Score, Circle)| {
        score.share >= if circle.radius_m < WIDE_M { MIN_SCORE_SHARE } else { MIN_WIDE_SHARE }
    };
    best.into_iter().filter(has_share).map(|(_, circle)| circle).collect()
}

/// The circle through three of some points.
fn three(near_m: &[[f64; 2]], random: &mut Random) -> Option<Circle> {
    let mut pick = || near_m.get(random.below(near_m.len())).copied();
    through([pick()?, pick()?, pick()?])
}

/// A guess fitted to the points about it, and judged. One that has grown far beyond the guess is fitted once
/// more, to all that is about it now: an apse shows through its ends what a column would not reach.
fn refined(
    params: &ShapeParams,
    start: Tube,
    seen: &Evidence<'_>,
    tried: &mut Vec<Tube>,
) -> Result<Accepted, Rejected> {
    let mut best = about(params, start, seen, tried)?;
    if best.tube.radius_m > GROWN * start.radius_m {
        let again = about(params, best.tube, seen, &mut Vec::new()).ok();
        best = again.filter(|again| again.on.len() > best.on.len()).unwrap_or(best);
    }
    Ok(best)
}

/// A tube fitted to the points about it, and judged, unless one was tried that came out as the same.
fn about(
    params: &ShapeParams,
    start: Tube,
    seen: &Evidence<'_>,
    tried: &mut Vec<Tube>,
) -> Result<Accepted, Rejected> {
    let reach_m = ABOUT_RADII * start.radius_m + ABOUT_DEVIATIONS * seen.sigma_m;
    let is_about = |i: &usize| {
        let [x, y, _] = start.axis.local(seen.points_m[*i]);
        x * x + y * y <= reach_m * reach_m
    };
    let about: Vec<usize> = (0..seen.points_m.len()).filter(is_about).collect();
    let (points_m, origins_m) = (picked(seen.points_m, &about), picked(seen.origins_m, &about));
    let own = Evidence { points_m: &points_m, origins_m: &origins_m, ..*seen };
    let rough = roughly_fitted(params, start, &own)?;
    let [x, y, _] = start.axis.local(rough.axis.point_m);
    if tried.iter().any(|other| is_same(other, &rough, seen.sigma_m)) {
        return Err(Rejected::Repeated);
    }
    // One that has not all of its surface about its start may come out better from another.
    if x.portable_hypot(y) + rough.radius_m + FIT_DEVIATIONS * seen.sigma_m <= reach_m {
        tried.push(rough);
    }
    let mut accepted = finally_fitted(params, rough, &own)?;
    accepted.on.iter_mut().for_each(|i| *i = about[*i]);
    Ok(accepted)
}

/// Whether two tubes of the same direction are one for every purpose.
fn is_same(a: &Tube, b: &Tube, sigma_m: f64) -> bool {
    let [x, y, _] = a.axis.local(b.axis.point_m);
    x.portable_hypot(y).max((a.radius_m - b.radius_m).abs()) <= SAME_DEVIATIONS * sigma_m
}

/// A cylinder fitted to the points on it, which are those without a long gap along the axis, and judged.
pub(crate) fn fitted(params: &ShapeParams, start: Tube, seen: &Evidence<'_>) -> Result<Accepted, Rejected> {
    finally_fitted(params, roughly_fitted(params, start, seen)?, seen)
}

/// A rough fit fitted to all of its points, and judged.
fn finally_fitted(params: &ShapeParams, rough: Tube, seen: &Evidence<'_>) -> Result<Accepted, Rejected> {
    let limits = (seen.sigma_m, FIT_DEVIATIONS * seen.sigma_m);
    let part = Part::of(&rough, seen, limits, MAX_FIT_POINTS)?;
    let tube = gauss_newton::fit_upright(rough, part.sample(), limits).ok_or(Rejected::Points)?;
    judge(params, &tube, seen)
}

/// A cylinder fitted to some of its points without turning its axis: here most guesses end.
fn roughly_fitted(params: &ShapeParams, start: Tube, seen: &Evidence<'_>) -> Result<Tube, Rejected> {
    let limits = (seen.sigma_m, FIT_DEVIATIONS * seen.sigma_m);
    let part = Part::of(&start, seen, limits, MAX_FIT_POINTS / 4)?;
    if part.length_m < MIN_LENGTH_M {
        return Err(Rejected::Length);
    }
    let tube = circle_fit::fit_settling(start, part.sample(), limits).ok_or(Rejected::Points)?;
    let some = Evidence { points_m: &part.points_m, origins_m: &part.origins_m, ..*seen };
    match may_become(params, &tube, &some, part.step) {
        Ok(()) => Ok(tube),
        // What leans is seen smeared along an axis that does not.
        Err(why) if why.may_be_a_lean() && gauss_newton::may_lean(&tube, part.sample(), limits) => Ok(tube),
        Err(why) => Err(why),
    }
}

/// Some of the points about a tube: those without a long gap along its axis.
struct Part {
    points_m: Vec<[f64; 3]>,
    origins_m: Vec<[f64; 3]>,
    length_m: f64,
    /// One in so many points was asked.
    step: usize,
}

impl Part {
    fn of(
        tube: &Tube,
        seen: &Evidence<'_>,
        (_, limit_m): (f64, f64),
        max_points: usize,
    ) -> Result<Self, Rejected> {
        let near = |p: &[f64; 3]| {
            let [x, y, along_m] = tube.axis.local(*p);
            ((x.portable_hypot(y) - tube.radius_m).abs() <= 2.0 * limit_m).then_some(along_m)
        };
        let along = seen.points_m.iter().filter_map(near);
        let [from, to] = longest_run(along).ok_or(Rejected::Points)?;
        let (direction, zero_m) = (tube.axis.direction(), dot(tube.axis.direction(), tube.axis.point_m));
        let inside = |i: &usize| (from..=to).contains(&(dot(direction, seen.points_m[*i]) - zero_m));
        let step = seen.points_m.len().div_ceil(max_points).max(1);
        let part: Vec<usize> = (0..seen.points_m.len()).step_by(step).filter(inside).collect();
        let (points_m, origins_m) = (picked(seen.points_m, &part), picked(seen.origins_m, &part));
        Ok(Self { points_m, origins_m, length_m: to - from, step })
    }

    fn sample(&self) -> Sample<'_> {
        Sample { points_m: &self.points_m, origins_m: &self.origins_m }
    }
}
