//! Round things: cylinders of any axis among the points of a cloud, between the search for planes and
//! polygons.
//!
//! Strips of planes that turn about an axis, and clusters of points on no wide plane, are searched for
//! cylinders; a cylinder stays when its points say so ([`fit::judge`]). Its points are then on no plane, and
//! planes that were only its strips are gone. Clouds without round things keep their planes as they are.
//! Frame `map`, meters.

pub(crate) mod finish;
pub(crate) mod fit;
pub(crate) mod params;
pub(crate) mod search;
#[cfg(test)]
mod tests;

use crate::model::cylinder::Cylinder;
use crate::model::{Cloud, Mesh};
use crate::reconstruct::planes::fit::scatter::Scatter;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::polygons::Merged;
use biplane_geometry::vec3::{cross, norm, unit};
use fit::judge::Accepted;
use fit::surface::Evidence;
use params::ShapeParams;
use rayon::prelude::*;
use search::curved_walls::{self, Curved};
use search::patches::{Patches, divide};
use search::{clusters, guesses};

/// The round things of a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Rounds {
    /// The cylinders, those with the largest number of points first.
    pub cylinders: Vec<Cylinder>,
    /// For every point the index of its cylinder, or -1; empty when there are none.
    pub labels: Vec<i32>,
}

impl Rounds {
    /// Lets polygons end where round things begin, and leaves out triangles that a round thing stands for.
    pub(crate) fn settle(&self, cloud: &Cloud, mesh: &Mesh, found: &Planes, merged: &mut Merged) {
        if self.cylinders.is_empty() {
            return;
        }
        finish::meet::meet(&found.planes, &mut merged.polygons, &self.cylinders);
        let is_round = |triangle: [u32; 3]| {
            let on = triangle.map(|corner| usize::try_from(self.labels[corner as usize]).ok());
            let Some(index) = on.into_iter().flatten().min() else { return false };
            let (cylinder, reach_m) = (&self.cylinders[index], BESIDE_DEVIATIONS * found.sigma_m);
            triangle.iter().all(|corner| {
                let (_, distance_m, _) = cylinder.around(cloud.points_m[*corner as usize].map(f64::from));
                (distance_m - cylinder.radius_m).abs() <= reach_m
            })
        };
        merged.rest.retain(|index| !is_round(mesh.triangles[*index]));
    }
}

/// Triangles of which a corner is on a round thing belong to it, when no corner is further off its surface.
const BESIDE_DEVIATIONS: f64 = 6.0;
/// Two level directions within this sine are one.
const SAME_SINE: f64 = 0.1;
/// Planes whose normals give the directions of pipes.
const MAX_WALLS: usize = 12;
/// A cluster that is so much longer than wide has an axis of its own.
const LONG_RATIO: f64 = 3.0;

/// Finds the round things of a cloud, and takes their points from its planes.
pub(crate) fn extract(params: &ShapeParams, cloud: &Cloud, found: &mut Planes) -> Rounds {
    if !params.enabled || found.labels.len() != cloud.len() {
        return Rounds::default();
    }
    let divided = divide(cloud, found);
    let curved = curved_walls::find(params, cloud, &divided, found.sigma_m);
    let single = single(params, cloud, found, &divided, &curved);
    let all: Vec<Accepted> = curved.iter().map(|curved| curved.accepted.clone()).chain(single).collect();
    let mut all = finish::unite::unite(params, cloud, found.sigma_m, all);
    finish::standing_out::retain(cloud, &divided, &mut all);
    if all.is_empty() {
        return Rounds::default();
    }
    let claimed = finish::claim::claim(params, cloud, found, &divided, &curved, all);
    finish::trim::cylinders(params, cloud, found, claimed)
}

/// The cylinders of clusters of points.
fn single(
    params: &ShapeParams,
    cloud: &Cloud,
    found: &Planes,
    divided: &Patches,
    curved: &[Curved],
) -> Vec<Accepted> {
    let mut taken = vec![false; cloud.len()];
    // What came out narrow of strips may have another side: it is looked for here as well, as a whole.
    let walls = || curved.iter().filter(|curved| curved.is_wide());
    let strips = walls().flat_map(|curved| &curved.patches);
    let points = strips.flat_map(|patch| &divided.patches[*patch as usize].points);
    points.for_each(|point| taken[*point as usize] = true);
    walls().flat_map(|curved| &curved.accepted.on).for_each(|point| taken[*point] = true);
    let free: Vec<u32> = divided.candidates.iter().copied().filter(|point| !taken[*point as usize]).collect();
    let level = level_directions(found);
    let of_cluster = |cluster: &Vec<u32>| {
        let points_m: Vec<[f64; 3]> =
            cluster.iter().map(|point| cloud.points_m[*point as usize].map(f64::from)).collect();
        let origin_of = |point: &u32| Some(cloud.origin_of(*point as usize)?.map(f64::from));
        let origins_m: Vec<[f64; 3]> = cluster.iter().filter_map(origin_of).collect();
        let seen = Evidence { points_m: &points_m, origins_m: &origins_m, sigma_m: found.sigma_m };
        let mut directions = vec![[0.0, 0.0, 1.0]];
        directions.extend(&level);
        directions.extend(own_direction(&points_m));
        let mut accepted = guesses::all(params, &seen, &directions);
        accepted.iter_mut().flat_map(|one| &mut one.on).for_each(|i| *i = cluster[*i] as usize);
        accepted
    };
    let clusters = clusters::of(cloud, &free, params.min_points);
    let found: Vec<Vec<Accepted>> = clusters.par_iter().map(of_cluster).collect();
    found.into_iter().flatten().collect()
}

/// Level directions along the largest walls, and across them: pipes follow walls.
fn level_directions(found: &Planes) -> Vec<[f64; 3]> {
    let mut directions: Vec<[f64; 3]> = Vec::new();
    let walls = found.planes.iter().filter(|plane| plane.normal[2].abs() < SAME_SINE).take(MAX_WALLS);
    for wall in walls {
        let [x, y, _] = wall.normal;
        for direction in [unit([x, y, 0.0]), unit([-y, x, 0.0])] {
            if directions.iter().all(|other| norm(cross(*other, direction)) > SAME_SINE) {
                directions.push(direction);
            }
        }
    }
    directions.truncate(MAX_LEVEL);
    directions
}

/// Level directions that are tried.
const MAX_LEVEL: usize = 4;

/// The direction of a long cluster.
fn own_direction(points_m: &[[f64; 3]]) -> Option<[f64; 3]> {
    let mut sum = Scatter::default();
    points_m.iter().for_each(|p| sum.add(*p));
    let fit = sum.fit()?;
    let [_, width, length] = fit.variances_m2;
    if length < LONG_RATIO * LONG_RATIO * width {
        return None;
    }
    // The points farthest apart along the longest of the axes, by two passes.
    let far = |from: [f64; 3]| {
        points_m.iter().copied().max_by(|a, b| {
            let off = |p: &[f64; 3]| norm([0, 1, 2].map(|k| p[k] - from[k]));
            off(a).total_cmp(&off(b))
        })
    };
    let first = far(sum.mean())?;
    let second = far(first)?;
    Some(unit([0, 1, 2].map(|k| second[k] - first[k])))
}
