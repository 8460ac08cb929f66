//! What ought to agree: each strip of the vertical laser with the wall that the horizontal one saw, with what the vertical one saw of the same surface from another heading, with the floor.
//!
//! Each agreement is a distance along a surface's normal, with how it changes with the parameters and its standard deviation as a model has it.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::placement::{Placement, Step};
use super::sights::{Patch, Patches, Sight};
use super::walls::{Piece, Walls};

/// What a strip is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
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
    pub const ALL: [Self; 4] = [Self::Wall, Self::Again, Self::Level, Self::Floor];
}

/// One distance that ought to be zero.
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    /// Of what kind.
    pub kind: Kind,
    /// The distance, metres.
    pub off_m: f64,
    /// How it changes with the parameters.
    pub slope: Step,
    /// Its standard deviation by the model, metres.
    pub sigma_m: f64,
}

/// Standard deviation of a range and of a pose's place, metres, and of a pose's heading, radians.
const RANGE_M: f64 = 0.015;
const PLACE_M: f64 = 0.006;
const HEADING_RAD: f64 = 0.002;
/// Growth of the poses' error between two sights, metres for the root of a second.
const DRIFT_M: f64 = 0.003;
/// A strip lies along a surface when its direction leans out of it by less than this (sine).
const LEAN: f64 = 0.35;
/// A wall's strip rises at least so steeply: flat ones may be ceiling.
const STEEP: f64 = 0.5;
/// A wall is held against a strip that the laser looked at not flatter than this (sine): what stands across a door frame is not the frame.
const FACING: f64 = 0.35;
/// How far along a surface a strip may be from the piece or patch that it is held against.
const ALONG_M: f64 = 0.3;
/// How far apart in time a wall may be seen by both lasers.
const WALL_NS: i64 = 10_000_000_000;
/// Headings differ when by more than this.
const ANOTHER_HEADING_RAD: f64 = 0.35;
/// A normal whose z is larger belongs to a level surface.
const LEVEL: f64 = 0.9;

/// The agreements of all sights whose distances are below `gate_m`.
pub fn agreements(
    sights: &[Sight],
    walls: &Walls,
    patches: &Patches,
    placement: &Placement,
    gate_m: f64,
) -> Vec<Agreement> {
    let of = |sight: &Sight| {
        let found = [
            with_wall(sight, walls, placement, gate_m),
            with_patch(sight, patches, placement, gate_m),
            with_floor(sight, placement, gate_m),
        ];
        found.into_iter().flatten().collect::<Vec<_>>()
    };
    sights.par_iter().map(of).collect::<Vec<_>>().concat()
}

fn own_variance(sight: &Sight) -> f64 {
    let heading_m = HEADING_RAD * sight.strip.range_m();
    RANGE_M * RANGE_M / sight.strip.points as f64 + PLACE_M * PLACE_M + heading_m * heading_m
}

fn apart_s(a_ns: i64, b_ns: i64) -> f64 {
    a_ns.abs_diff(b_ns) as f64 * 1e-9
}

fn with_wall(sight: &Sight, walls: &Walls, placement: &Placement, gate_m: f64) -> Option<Agreement> {
    if sight.along.z.abs() < STEEP {
        return None;
    }
    let ray = sight.ray(placement);
    let off = |piece: &Piece| {
        let (x, y) = (sight.at.x - piece.centre_m[0], sight.at.y - piece.centre_m[1]);
        (x * piece.normal[0] + y * piece.normal[1], y * piece.normal[0] - x * piece.normal[1])
    };
    let fits = |piece: &Piece| {
        let (across_m, along_m) = off(piece);
        let lean = sight.along.x * piece.normal[0] + sight.along.y * piece.normal[1];
        let faces = (ray[0] * piece.normal[0] + ray[1] * piece.normal[1]).abs() > FACING;
        let fit = across_m.abs() < gate_m && along_m.abs() < ALONG_M && lean.abs() < LEAN && faces;
        (fit && piece.stamp_ns.abs_diff(sight.stamp_ns) < WALL_NS as u64)
            .then(|| along_m.abs() / 0.1 + apart_s(piece.stamp_ns, sight.stamp_ns))
    };
    let (piece, _) = walls
        .near([sight.at.x, sight.at.y])
        .filter_map(|piece| Some((piece, fits(piece)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let (off_m, along_m) = off(piece);
    let normal = Vector3::new(piece.normal[0], piece.normal[1], 0.0);
    let variance = own_variance(sight)
        + RANGE_M * RANGE_M / piece.points as f64 * (1.0 + along_m * along_m / piece.spread_m2)
        + DRIFT_M * DRIFT_M * apart_s(piece.stamp_ns, sight.stamp_ns);
    let slope = (normal.transpose() * sight.jacobian(placement)).transpose();
    Some(Agreement { kind: Kind::Wall, off_m, slope, sigma_m: variance.sqrt() })
}

fn with_patch(sight: &Sight, patches: &Patches, placement: &Placement, gate_m: f64) -> Option<Agreement> {
    let fits = |patch: &&Patch| {
        let off = sight.at - patch.centre;
        let across_m = off.dot(&patch.normal);
        let turned = (sight.pose.theta_rad - patch.heading_rad).cos() < ANOTHER_HEADING_RAD.cos();
        turned
            && across_m.abs() < gate_m
            && (off - patch.normal * across_m).norm() < ALONG_M
            && sight.along.dot(&patch.normal).abs() < LEAN
    };
    let patch = patches
        .near(&sight.at)
        .iter()
        .filter(fits)
        .min_by_key(|patch| patch.stamp_ns.abs_diff(sight.stamp_ns))?;
    let level = patch.normal.z.abs() > LEVEL;
    let drift = if level { 0.0 } else { DRIFT_M * DRIFT_M * apart_s(patch.stamp_ns, sight.stamp_ns) };
    let slope = (patch.normal.transpose() * (sight.jacobian(placement) - patch.jacobian)).transpose();
    Some(Agreement {
        kind: if level { Kind::Level } else { Kind::Again },
        off_m: (sight.at - patch.centre).dot(&patch.normal),
        slope,
        sigma_m: (own_variance(sight) + PLACE_M * PLACE_M + drift).sqrt(),
    })
}

fn with_floor(sight: &Sight, placement: &Placement, gate_m: f64) -> Option<Agreement> {
    let below = placement.base_from_laser.translation.z - sight.at.z > 0.2;
    let fits = below && sight.along.z.abs() < LEAN && sight.at.z.abs() < gate_m.min(0.2);
    fits.then(|| Agreement {
        kind: Kind::Floor,
        off_m: sight.at.z,
        slope: sight.jacobian(placement).row(2).transpose(),
        sigma_m: own_variance(sight).sqrt(),
    })
}
