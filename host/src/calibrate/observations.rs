//! Strips posed in `map` for one guess of the laser's place, and the patches of surface that they make up.
//!
//! A patch is what two seconds of driving saw of a surface in one cell of space. Meters.

use biplane_geometry::PortableMath;
use std::collections::HashMap;

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use super::placement::{Placement, PointJacobian};
use super::strips::Strip;
use super::walls::on_floor;
use crate::recordings::deskew::{StampedPose, Trajectory};

/// Side of a cell of space.
const CELL_M: f64 = 0.5;
/// How long strips are gathered for a patch.
const GATHER_NS: i64 = 2_000_000_000;
/// Strips of a patch at least.
const FEWEST: usize = 3;
/// Root mean square distance of a patch's points from its plane at most, and along its shorter side at least.
const ROUGH_M: f64 = 0.035;
const NARROWEST_M: f64 = 0.05;
const LONGEST_GAP_NS: i64 = 500_000_000;
/// A velocity is taken over twice this.
const HALF_STEP_NS: i64 = 50_000_000;

/// A cell of space.
pub(super) type Cell = [i32; 3];

/// A strip in `map`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// The strip.
    pub strip: Strip,
    /// When it was seen, as the guess has it, nanoseconds.
    pub stamp_ns: i64,
    /// Where the base was then.
    pub pose: StampedPose,
    /// How it moved: m/s, m/s, rad/s.
    pub velocity: Vector3<f64>,
    /// The strip's center.
    pub at: Point3<f64>,
    /// The strip's direction.
    pub along: Vector3<f64>,
}

impl Observation {
    /// The direction in which the laser looked at it.
    pub(super) fn ray(&self, placement: &Placement) -> Vector3<f64> {
        let laser = placement.base_from_laser.translation.vector;
        let [x, y] = on_floor(&self.pose, [laser.x, laser.y]);
        self.at.coords - Vector3::new(x, y, laser.z)
    }

    /// How its center moves with the parameters.
    pub(super) fn jacobian(&self, placement: &Placement) -> PointJacobian {
        placement.jacobian(self.strip.center_m, &self.pose, self.velocity)
    }
}

/// The strips posed in order; those where nobody knows the pose are left out.
pub(super) fn posed(strips: &[Strip], placement: &Placement, trajectory: &Trajectory) -> Vec<Observation> {
    let late_ns = (placement.late_s * 1e9).round() as i64;
    strips.par_iter().filter_map(|strip| observation(strip, placement, trajectory, late_ns)).collect()
}

fn observation(
    strip: &Strip,
    placement: &Placement,
    trajectory: &Trajectory,
    late_ns: i64,
) -> Option<Observation> {
    let stamp_ns = strip.stamp_ns.saturating_sub(late_ns);
    let pose = trajectory.at(stamp_ns, LONGEST_GAP_NS)?;
    let before = trajectory.at(stamp_ns.saturating_sub(HALF_STEP_NS), LONGEST_GAP_NS)?;
    let after = trajectory.at(stamp_ns.saturating_add(HALF_STEP_NS), LONGEST_GAP_NS)?;
    let velocity = Vector3::new(after.x_m - before.x_m, after.y_m - before.y_m, before.turn_rad(&after))
        / (2.0 * HALF_STEP_NS as f64 * 1e-9);
    let in_base = placement.base_from_laser * Point3::new(strip.center_m[0], strip.center_m[1], 0.0);
    let along = placement.base_from_laser * Vector3::new(strip.along[0], strip.along[1], 0.0);
    let (sin, cos) = pose.theta_rad.portable_sin_cos();
    let turned = |v: Vector3<f64>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
    let at = Point3::from(turned(in_base.coords) + Vector3::new(pose.x_m, pose.y_m, 0.0));
    Some(Observation { strip: *strip, stamp_ns, pose, velocity, at, along: turned(along) })
}

/// A piece of surface.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// When it was seen, nanoseconds.
    pub stamp_ns: i64,
    /// Heading of the base then.
    pub heading_rad: f64,
    /// Mean of its points.
    pub center: Point3<f64>,
    /// Across it, unit length.
    pub normal: Vector3<f64>,
    /// How its center moves with the parameters.
    pub jacobian: PointJacobian,
}

/// All patches, by cell of space.
#[derive(Clone, Debug, Default)]
pub(super) struct Patches {
    cells: HashMap<Cell, Vec<Patch>>,
}

impl Patches {
    /// Of strips in the order of time.
    pub(super) fn of(observations: &[Observation], placement: &Placement) -> Self {
        let block = |observation: &Observation| observation.strip.stamp_ns.div_euclid(GATHER_NS);
        let groups: Vec<&[Observation]> = observations.chunk_by(|a, b| block(a) == block(b)).collect();
        let patches: Vec<Vec<(Cell, Patch)>> =
            groups.par_iter().map(|group| patches_of(group, placement)).collect();
        let mut all = Self::default();
        for (cell, patch) in patches.into_iter().flatten() {
            all.cells.entry(cell).or_default().push(patch);
        }
        all
    }

    /// The patches of the cell of a point.
    pub(super) fn near(&self, at: &Point3<f64>) -> &[Patch] {
        self.cells.get(&cell(at)).map_or(&[], Vec::as_slice)
    }
}

fn cell(at: &Point3<f64>) -> Cell {
    [at.x, at.y, at.z].map(|value| (value / CELL_M).floor() as i32)
}

fn patches_of(observations: &[Observation], placement: &Placement) -> Vec<(Cell, Patch)> {
    let mut order: Vec<(Cell, usize)> =
        observations.iter().enumerate().map(|(i, observation)| (cell(&observation.at), i)).collect();
    order.sort_unstable();
    let group = |group: &[(Cell, usize)]| {
        let members: Vec<&Observation> = group.iter().map(|(_, index)| &observations[*index]).collect();
        patch(&members, placement).map(|patch| (group[0].0, patch))
    };
    order.chunk_by(|a, b| a.0 == b.0).filter_map(group).collect()
}

fn patch(members: &[&Observation], placement: &Placement) -> Option<Patch> {
    if members.len() < FEWEST {
        return None;
    }
    let points: usize = members.iter().map(|observation| observation.strip.points).sum();
    let count = points as f64;
    let mut center = Vector3::zeros();
    for observation in members {
        center += observation.at.coords * (observation.strip.points as f64 / count);
    }
    let mut scatter = Matrix3::zeros();
    for observation in members {
        let (off, share) = (observation.at.coords - center, observation.strip.points as f64 / count);
        scatter += (off * off.transpose()
            + observation.along * observation.along.transpose() * observation.strip.spread_m2)
            * share;
    }
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [minimum, middle] = [eigen.eigenvalues[order[0]], eigen.eigenvalues[order[1]]];
    if minimum > ROUGH_M * ROUGH_M || middle < NARROWEST_M * NARROWEST_M || minimum > 0.15 * middle {
        return None;
    }
    let mut jacobian = PointJacobian::zeros();
    for observation in members {
        jacobian += observation.jacobian(placement) * (observation.strip.points as f64 / count);
    }
    let middle = members[members.len() / 2];
    Some(Patch {
        stamp_ns: middle.stamp_ns,
        heading_rad: middle.pose.theta_rad,
        center: Point3::from(center),
        normal: eigen.eigenvectors.column(order[0]).into_owned(),
        jacobian,
    })
}
