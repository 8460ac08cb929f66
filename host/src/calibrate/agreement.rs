//! What ought to agree: each strip of the vertical laser with the wall that the horizontal one saw, with what
//! the vertical one saw of the same surface from another heading, with the floor.
//!
//! Each agreement is a distance along a surface's normal, with how it changes with the parameters and its
//! standard deviation as a model has it.

use biplane_geometry::PortableMath;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::placement::{Placement, Step};
use super::walls::{Line, Piece, Walls};
use crate::calibrate::observations::{Observation, Patch, Patches};

/// What a strip is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A wall that the horizontal laser saw.
    Wall,
    /// The same upright or slanting surface, seen from another heading.
    Again,
    /// The same level surface (a ceiling), seen from another heading.
    Level,
    /// The floor, z = 0.
    Floor,
}

impl Kind {
    /// All kinds.
    pub(super) const ALL: [Self; 4] = [Self::Wall, Self::Again, Self::Level, Self::Floor];
}

/// One distance that ought to be zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    /// Of what kind.
    pub kind: Kind,
    /// The distance, meters.
    pub off_m: f64,
    /// How it changes with the parameters.
    pub slope: Step,
    /// Its standard deviation by the model, meters.
    pub sigma_m: f64,
    /// The surface that it is of, in about a meter.
    pub surface: Surface,
}

/// A cell of space and the axis that a surface there looks along: all agreements of one are off together by
/// what it is not as it is taken for.
pub(super) type Surface = ([i32; 3], i32);

/// Side of a cell, meters.
const CELL_M: f64 = 1.0;

/// How far a observation lies off its surface.
struct Offset {
    /// Distance across the surface, meters.
    across_m: f64,
    /// The surface's normal, of unit length.
    normal: Vector3<f64>,
    /// How the distance changes with the placement's parameters.
    slope: Step,
}

/// What is `across_m` off a surface with this normal, which may look either way: seen from the laser more is
/// farther.
fn agreement(
    kind: Kind,
    observation: &Observation,
    placement: &Placement,
    offset: &Offset,
    variance: f64,
) -> Agreement {
    let &Offset { across_m, normal, slope } = offset;
    let towards = if observation.ray(placement).dot(&normal) < 0.0 { -1.0 } else { 1.0 };
    let axis = normal.iamax();
    let cell =
        [observation.at.x, observation.at.y, observation.at.z].map(|value| (value / CELL_M).floor() as i32);
    let side = if normal[axis] * towards < 0.0 { -1 - axis as i32 } else { axis as i32 };
    Agreement {
        kind,
        off_m: across_m * towards,
        slope: slope * towards,
        sigma_m: variance.sqrt(),
        surface: (cell, side),
    }
}

/// Standard deviation of a range and of a pose's place, meters, and of a pose's heading, radians.
const RANGE_M: f64 = 0.015;
const PLACE_M: f64 = 0.006;
const HEADING_RAD: f64 = 0.002;
/// Growth of the poses' error between two observations, meters for the root of a second.
const DRIFT_M: f64 = 0.003;
/// A strip lies along a surface when its direction leans out of it by less than this (sine).
const LEAN: f64 = 0.35;
/// A wall's strip rises at least so steeply: flat ones may be ceiling.
const STEEP: f64 = 0.5;
/// A wall is held against a strip that the laser looked at not flatter than this (sine): what stands across a
/// door frame is not the frame.
const FACING: f64 = 0.35;
/// How far along a surface a strip may be from the piece or patch that it is held against.
const ALONG_M: f64 = 0.3;
/// How far apart in time a wall may be seen by both lasers.
const WALL_NS: i64 = 10_000_000_000;
/// Headings differ when by more than this.
const ANOTHER_HEADING_RAD: f64 = 0.35;
/// A normal whose z is larger belongs to a level surface.
const LEVEL: f64 = 0.9;

/// The agreements of all observations whose distances are below `gate_m`.
pub(super) fn agreements(
    observations: &[Observation],
    walls: &Walls,
    patches: &Patches,
    placement: &Placement,
    gate_m: f64,
) -> Vec<Agreement> {
    let of = |observation: &Observation| {
        let found = [
            with_wall(observation, walls, placement, gate_m),
            with_patch(observation, patches, placement, gate_m),
            with_floor(observation, placement, gate_m),
        ];
        found.into_iter().flatten().collect::<Vec<_>>()
    };
    observations.par_iter().map(of).collect::<Vec<_>>().concat()
}

fn own_variance(observation: &Observation) -> f64 {
    let heading_m = HEADING_RAD * observation.strip.range_m();
    RANGE_M * RANGE_M / observation.strip.points as f64 + PLACE_M * PLACE_M + heading_m * heading_m
}

fn apart_s(a_ns: i64, b_ns: i64) -> f64 {
    a_ns.abs_diff(b_ns) as f64 * 1e-9
}

fn with_wall(
    observation: &Observation,
    walls: &Walls,
    placement: &Placement,
    gate_m: f64,
) -> Option<Agreement> {
    if observation.along.z.abs() < STEEP {
        return None;
    }
    let ray = observation.ray(placement);
    let at = [observation.at.x, observation.at.y];
    let fits = |piece: &Piece| {
        let normal = piece.line.normal;
        let [across_m, _] = piece.line.off(at);
        let along_m = Line { center_m: piece.center_m, ..piece.line }.off(at)[1];
        let lean = observation.along.x * normal[0] + observation.along.y * normal[1];
        let faces = (ray.x * normal[0] + ray.y * normal[1]).abs() > FACING * ray.xy().norm();
        let fit = across_m.abs() < gate_m && along_m.abs() < ALONG_M && lean.abs() < LEAN && faces;
        (fit && piece.stamp_ns.abs_diff(observation.stamp_ns) < WALL_NS as u64)
            .then(|| along_m.abs() / 0.1 + apart_s(piece.stamp_ns, observation.stamp_ns))
    };
    let (piece, _) =
        walls.near(at).filter_map(|piece| Some((piece, fits(piece)?))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let line = &piece.line;
    let [off_m, along_m] = line.off(at);
    let normal = Vector3::new(line.normal[0], line.normal[1], 0.0);
    let variance = own_variance(observation)
        + RANGE_M * RANGE_M / line.points as f64 * (1.0 + along_m * along_m / line.spread_m2)
        + DRIFT_M * DRIFT_M * apart_s(piece.stamp_ns, observation.stamp_ns);
    let slope = (normal.transpose() * observation.jacobian(placement)).transpose();
    Some(agreement(Kind::Wall, observation, placement, &Offset { across_m: off_m, normal, slope }, variance))
}

fn with_patch(
    observation: &Observation,
    patches: &Patches,
    placement: &Placement,
    gate_m: f64,
) -> Option<Agreement> {
    let fits = |patch: &&Patch| {
        let off = observation.at - patch.center;
        let across_m = off.dot(&patch.normal);
        let turned = (observation.pose.theta_rad - patch.heading_rad).portable_cos()
            < ANOTHER_HEADING_RAD.portable_cos();
        turned
            && across_m.abs() < gate_m
            && (off - patch.normal * across_m).norm() < ALONG_M
            && observation.along.dot(&patch.normal).abs() < LEAN
    };
    let patch = patches
        .near(&observation.at)
        .iter()
        .filter(fits)
        .min_by_key(|patch| patch.stamp_ns.abs_diff(observation.stamp_ns))?;
    let level = patch.normal.z.abs() > LEVEL;
    let drift = if level { 0.0 } else { DRIFT_M * DRIFT_M * apart_s(patch.stamp_ns, observation.stamp_ns) };
    let slope = (patch.normal.transpose() * (observation.jacobian(placement) - patch.jacobian)).transpose();
    let kind = if level { Kind::Level } else { Kind::Again };
    let off_m = (observation.at - patch.center).dot(&patch.normal);
    let variance = own_variance(observation) + PLACE_M * PLACE_M + drift;
    let offset = Offset { across_m: off_m, normal: patch.normal, slope };
    Some(agreement(kind, observation, placement, &offset, variance))
}

fn with_floor(observation: &Observation, placement: &Placement, gate_m: f64) -> Option<Agreement> {
    let below = placement.base_from_laser.translation.z - observation.at.z > 0.2;
    let fits = below && observation.along.z.abs() < LEAN && observation.at.z.abs() < gate_m.min(0.2);
    let slope = observation.jacobian(placement).row(2).transpose();
    fits.then(|| {
        let offset = Offset { across_m: observation.at.z, normal: Vector3::z(), slope };
        agreement(Kind::Floor, observation, placement, &offset, own_variance(observation))
    })
}
