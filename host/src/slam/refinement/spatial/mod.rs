//! Poses in all six directions: both lasers, each beam at its own time, on planes; wheels that stand on a
//! ground; ground that is seen ahead and driven over later.
//!
//! The way, step by step: knots of the trajectory every so often ([`knots`]) -> beams of both lasers
//! ([`beams`]) -> what the base counted and an inertial unit felt ([`motion`]) -> ground seen
//! ahead ([`floor_hits`]) -> rounds of planes ([`surfaces`]) and sparse steps ([`adjustment`],
//! [`normal_equations`]), grown from the start of the way ([`growth`]), then over all of it -> whether they
//! explain beams that took no part better ([`choice`]) -> how surely they are known ([`observability`]).
//!
//! Where no ground is seen ahead, by the wheels' track and by that of the poses so far, and no inertial unit
//! tells of a slope, nothing is refined: a flat floor is flat to the bit.
//!
//! Frame `map`, meters, radians, nanoseconds. Results do not depend on the number of threads.

pub(crate) mod adjustment;
pub(crate) mod beams;
pub(crate) mod choice;
pub(crate) mod floor_hits;
pub(crate) mod growth;
pub(crate) mod knots;
pub(crate) mod motion;
pub(crate) mod normal_equations;
pub(crate) mod observability;
pub(crate) mod params;
pub(crate) mod surfaces;

use crate::recordings::deskew::Trajectory;
use crate::recordings::run::{Run, RunError, VerticalScans};
use crate::slam::refinement::spatial::beams::{BeamHit, Choice, Laser, beam_hits};
use crate::slam::refinement::spatial::choice::{Refined, choose};
use crate::slam::refinement::spatial::floor_hits::FloorHits;
use crate::slam::refinement::spatial::knots::Knots;
use crate::slam::refinement::spatial::motion::inertial::Inertial;
use crate::slam::refinement::spatial::motion::inertial_samples::{InertialSample, inertial_samples};
use crate::slam::refinement::spatial::motion::wheels::Wheels;
use crate::slam::refinement::spatial::params::SpatialParams;
use adjustment::Problem;

/// A gap of the trajectory longer than this is not bridged, nanoseconds.
const GAP_NS: i64 = 1_000_000_000;

/// What is refined.
pub(crate) struct SpatialInput<'a> {
    /// The poses so far.
    pub trajectory: &'a Trajectory,
    /// The base's own odometry.
    pub odometry: &'a Trajectory,
    /// What an inertial unit felt, in the order of stamps; none without one.
    pub inertial: &'a [InertialSample],
    /// The scans of the laser that localizes.
    pub horizontal: &'a VerticalScans,
    /// The scans of the laser that sees the building.
    pub vertical: &'a VerticalScans,
}

/// Refines; `None` when there is too little to refine with, or nothing that explains the beams better.
pub(crate) fn refine(input: &SpatialInput<'_>, params: &SpatialParams) -> Option<Refined> {
    let start = Knots::of(input.trajectory, (params.knot_s * 1e9) as i64, GAP_NS)?;
    if !may_be_sloped(input, &start, params)? {
        return None;
    }
    let hits = hits(input, &start, params);
    let both = [Laser::Horizontal, Laser::Vertical].map(|laser| hits.iter().any(|hit| hit.laser == laser));
    if both != [true, true] {
        return None;
    }
    let wheels = Wheels::new(input.odometry, &start)?;
    let way_m = wheels.way_m();
    // Odometry that drifts puts walls over the way, and a ramp drags matched poses along: both have to tell,
    // or the poses of all that lies ahead were dragged.
    let track = wheels.dead_reckoned(&start);
    let mut floor = FloorHits::find(&hits, &track, &way_m);
    let sees_ground = floor.are_many()
        && (floor.have_dragged(&hits, &start, &track) || FloorHits::find(&hits, &start, &way_m).agree());
    let inertial = Inertial::of(input.inertial, &start, &wheels);
    if !sees_ground && !inertial.as_ref().is_some_and(Inertial::reports_slope) {
        return None;
    }
    if !sees_ground {
        floor = FloorHits::none(&hits);
    }
    let starts =
        (0..=start.states.len()).map(|knot| hits.partition_point(|hit| (hit.knot as usize) < knot)).collect();
    let pieces = way_m.iter().map(|way_m| (way_m / params.piece_m) as u32).collect();
    let anchor = start.states[0];
    let (wheels, inertial) = (&wheels, inertial.as_ref());
    let problem = Problem { hits: &hits, starts, anchor, wheels, inertial, floor: &floor, pieces, params };
    choose(&problem, &start)
}

/// Whether an inertial unit tells of a slope, or enough scans see ground ahead by the wheels' track. Most
/// floors are flat, and a long drive has millions of beams: here no more than those of one scan are held.
fn may_be_sloped(input: &SpatialInput<'_>, start: &Knots, params: &SpatialParams) -> Option<bool> {
    let wheels = Wheels::new(input.odometry, start)?;
    if Inertial::of(input.inertial, start, &wheels).is_some_and(|inertial| inertial.reports_slope()) {
        return Some(true);
    }
    let VerticalScans { geometry, range_scans, .. } = input.horizontal;
    let scans = beam_hits(Laser::Horizontal, geometry, range_scans, start, choice_of(params));
    Some(FloorHits::are_in_many(scans, &wheels.dead_reckoned(start), &wheels.way_m()))
}

/// Refines the poses of one recording; `None` when it has no vertical laser, or nothing explains its beams
/// better.
///
/// # Errors
/// When the recording is damaged.
pub(crate) fn refine_run(run: &Run, trajectory: &Trajectory) -> Result<Option<Refined>, RunError> {
    let Some(vertical) = run.vertical_scans()?.filter(|scans| !scans.range_scans.is_empty()) else {
        return Ok(None);
    };
    let Some(horizontal) = run.horizontal_scans()? else { return Ok(None) };
    let inertial = inertial_samples(run)?;
    let odometry = Trajectory::new(run.stamps_and_poses()?.odometry);
    let input = SpatialInput {
        trajectory,
        odometry: &odometry,
        inertial: &inertial,
        horizontal: &horizontal,
        vertical: &vertical,
    };
    Ok(refine(&input, &SpatialParams::default()))
}

fn choice_of(params: &SpatialParams) -> Choice {
    Choice { beams_per_s: params.beams_per_s, range_max_m: params.range_max_m }
}

/// The beams of both lasers in the order of knots.
fn hits(input: &SpatialInput<'_>, knots: &Knots, params: &SpatialParams) -> Vec<BeamHit> {
    let choice = choice_of(params);
    let mut hits: Vec<BeamHit> = Vec::new();
    for (laser, scans) in [(Laser::Horizontal, input.horizontal), (Laser::Vertical, input.vertical)] {
        hits.extend(beam_hits(laser, &scans.geometry, &scans.range_scans, knots, choice).flatten());
    }
    hits.sort_by_key(|hit| hit.knot);
    hits
}
