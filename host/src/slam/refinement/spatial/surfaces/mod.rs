//! Planes in what both lasers saw, for poses as they are now.
//!
//! What the vertical laser saw is cut into voxels; flat ones are joined to their neighbors while they go on
//! in one plane. What only the horizontal laser saw is a line, of which nobody knows how it leans: its
//! plane is upright. Near-level planes may be cut into pieces of the way. Frame `map`, meters.

mod voxels;

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use crate::slam::refinement::spatial::beams::{Laser, Point};
use crate::slam::refinement::spatial::surfaces::voxels::{
    Key, VoxelMap, around, cell, key, key_of, ordered, runs,
};
use biplane_geometry::vec3::{cross, dot, minus, norm, plus, unit};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// How planes are sought.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// Side of a voxel, meters.
    pub voxel_m: f64,
    /// Root mean square of a flat voxel's points about their plane at most, meters.
    pub thickness_m: f64,
    /// Voxels whose normals differ by less go on in one plane, radians.
    pub angle_rad: f64,
    /// And whose middles are off that plane by less, meters.
    pub step_m: f64,
    /// A point belongs to a plane within this distance, meters.
    pub gate_m: f64,
    /// Whether near-level planes are cut into pieces of the way.
    pub in_pieces: bool,
}

/// A plane: `normal . (p - middle) = 0`, turned by two angles about two of its directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub normal: [f64; 3],
    pub middle_m: [f64; 3],
    /// Directions in the plane; of an upright one the first is level and the second points up.
    pub tangents: [[f64; 3]; 2],
    /// Only its line on the floor plan is known.
    pub is_line: bool,
}

/// A voxel needs so many points.
const VOXEL_POINTS: usize = 8;
/// A plane needs so many.
const SURFACE_POINTS: f64 = 40.0;
/// A patch whose second spread is smaller is a line, meters: it tells no plane; the same on the floor plan.
const MIN_SPREAD_M: f64 = 0.04;
const MIN_LINE_SPREAD_M: f64 = 0.08;
/// Level within this is near level: ceilings, floors, ramps.
const NEAR_LEVEL: f64 = 0.93;
/// What the horizontal laser sees at heights further apart is not one wall, meters.
const SLAB_M: f64 = 2.0;

impl Surface {
    fn new(normal: [f64; 3], middle_m: [f64; 3], is_line: bool) -> Self {
        let level = cross([0.0, 0.0, 1.0], normal);
        let first = if norm(level) > 0.1 { unit(level) } else { unit(cross(normal, [0.0, 1.0, 0.0])) };
        Self { normal, middle_m, tangents: [first, cross(normal, first)], is_line }
    }

    /// Off the plane, meters.
    pub(crate) fn distance_m(&self, at_m: [f64; 3]) -> f64 {
        dot(self.normal, minus(at_m, self.middle_m))
    }

    /// Turned about its tangents and moved along its normal.
    pub(crate) fn stepped(&self, [first, second, off_m]: [f64; 3]) -> Self {
        let turned = |axis: usize| {
            self.normal[axis] + first * self.tangents[0][axis] + second * self.tangents[1][axis]
        };
        let normal = unit(std::array::from_fn(turned));
        let middle_m = std::array::from_fn(|axis| self.middle_m[axis] + off_m * self.normal[axis]);
        Self::new(normal, middle_m, self.is_line)
    }
}

/// Which planes pass through a region's voxels.
#[derive(Clone, Debug)]
enum Region {
    Whole(Option<u32>),
    Pieces(BTreeMap<u32, u32>),
}

/// Planes, and where to look for them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces {
    pub list: Vec<Surface>,
    regions: Vec<Region>,
    /// The regions around each voxel.
    cells: VoxelMap,
    /// The planes of lines around each.
    line_cells: VoxelMap,
    voxel_m: f64,
    gate_m: f64,
}

/// Sums of points.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: f64,
    sum: Vector3<f64>,
    squares: Matrix3<f64>,
}

impl Moments {
    fn add(&mut self, at_m: [f64; 3], origin_m: [f64; 3]) {
        let at = Vector3::from(minus(at_m, origin_m));
        self.count += 1.0;
        self.sum += at;
        self.squares += at * at.transpose();
    }

    fn middle(&self) -> Vector3<f64> {
        self.sum / self.count.max(1.0)
    }

    /// Variances, ascending, and their directions.
    fn spread(&self) -> ([f64; 3], [Vector3<f64>; 3]) {
        let middle = self.middle();
        let covariance = self.squares / self.count.max(1.0) - middle * middle.transpose();
        let eigen = SymmetricEigen::new(covariance);
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let axis = |at: usize| eigen.eigenvectors.column(at).into_owned();
        (order.map(|at| eigen.eigenvalues[at].max(0.0)), order.map(axis))
    }
}

/// A flat voxel.
#[derive(Clone, Debug)]
struct Patch {
    key: Key,
    points: std::ops::Range<usize>,
    normal: [f64; 3],
    middle_m: [f64; 3],
    region: Option<u32>,
}

impl Surfaces {
    /// Seeks planes in points; and the plane that each of the points belongs to.
    pub(crate) fn find(points: &[Point], search: &Search) -> (Self, Vec<Option<u32>>) {
        let mut found = Self { voxel_m: search.voxel_m, gate_m: search.gate_m, ..Self::default() };
        let numbered = (0..).zip(points).filter(|(_, point)| point.laser == Laser::Vertical);
        let vertical =
            ordered(numbered.map(|(number, point)| (key_of(point.at_m, search.voxel_m), number)).collect());
        let mut patches = flat_voxels(points, &vertical, search);
        let count = grow(&mut patches, search);
        found.regions_of(points, &vertical, &patches, count, search);
        let mut planes: Vec<Option<u32>> = points.par_iter().map(|point| found.plane_of(point)).collect();
        found.lines(points, &planes, search);
        points.par_iter().zip(&mut planes).for_each(|(point, plane)| {
            if plane.is_none() && point.laser == Laser::Horizontal {
                *plane = found.line_of(point);
            }
        });
        (found, planes)
    }

    fn regions_of(
        &mut self,
        points: &[Point],
        order: &[(Key, u32)],
        patches: &[Patch],
        count: usize,
        search: &Search,
    ) {
        for of_region in members(patches, count) {
            let of_points =
                || of_region.iter().flat_map(|&at| patches[at].points.clone()).map(|at| order[at].1 as usize);
            let near_level = of_region.iter().map(|&at| patches[at].normal[2].abs()).sum::<f64>()
                > NEAR_LEVEL * of_region.len() as f64;
            let region = if search.in_pieces && near_level {
                let mut pieces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
                of_points().for_each(|at| pieces.entry(points[at].piece).or_default().push(at));
                let fitted = pieces.into_iter().filter_map(|(piece, of_piece)| {
                    Some((piece, self.fit(points, of_piece.into_iter(), search)?))
                });
                Region::Pieces(fitted.collect())
            } else {
                Region::Whole(self.fit(points, of_points(), search))
            };
            let number = self.regions.len() as u32;
            self.regions.push(region);
            register(&mut self.cells, of_region.iter().map(|&at| patches[at].key), number);
        }
    }

    /// A plane through points; `None` for few or a line.
    fn fit(&mut self, points: &[Point], which: impl Iterator<Item = usize>, search: &Search) -> Option<u32> {
        let mut moments = Moments::default();
        let mut origin_m = None;
        for at in which {
            let origin_m = *origin_m.get_or_insert(points[at].at_m);
            moments.add(points[at].at_m, origin_m);
        }
        let (variances, axes) = moments.spread();
        let is_plane = moments.count >= SURFACE_POINTS
            && variances[1].sqrt() > MIN_SPREAD_M
            && variances[0].sqrt() < 2.0 * search.thickness_m;
        let origin_m = origin_m.filter(|_| is_plane)?;
        let middle_m = plus(moments.middle().into(), origin_m);
        self.list.push(Surface::new(axes[0].into(), middle_m, false));
        Some(self.list.len() as u32 - 1)
    }

    /// Upright planes of what only the horizontal laser saw: what belongs to no other plane.
    fn lines(&mut self, points: &[Point], planes: &[Option<u32>], search: &Search) {
        let alone = (0..)
            .zip(points.iter().zip(planes))
            .filter(|(_, (point, plane))| point.laser == Laser::Horizontal && plane.is_none())
            .map(|(number, (point, _))| (self.slab_of(point), number));
        let order = ordered(alone.collect());
        let mut patches = Vec::new();
        for points_of in runs(&order) {
            let (moments, origin_m) = moments_of(points, &order[points_of.clone()], true);
            let (variances, axes) = moments.spread();
            // Heights are left out, so the smallest variance is that of z: nothing.
            let is_line = variances[1].sqrt() < search.thickness_m && variances[2].sqrt() > MIN_LINE_SPREAD_M;
            if moments.count >= VOXEL_POINTS as f64 && is_line {
                let middle_m = plus(moments.middle().into(), origin_m);
                let along = axes[2];
                let normal = unit([-along.y, along.x, 0.0]);
                let key = order[points_of.start].0;
                patches.push(Patch { key, points: points_of, normal, middle_m, region: None });
            }
        }
        let count = grow(&mut patches, search);
        for of_region in members(&patches, count) {
            let which = of_region.iter().flat_map(|&at| order[patches[at].points.clone()].iter().copied());
            let which: Vec<(Key, u32)> = which.collect();
            if (which.len() as f64) < 0.5 * SURFACE_POINTS {
                continue;
            }
            let (moments, origin_m) = moments_of(points, &which, true);
            let (_, axes) = moments.spread();
            let middle_m = plus(moments.middle().into(), origin_m);
            self.list.push(Surface::new(unit([-axes[2].y, axes[2].x, 0.0]), middle_m, true));
            let number = self.list.len() as u32 - 1;
            register(&mut self.line_cells, of_region.iter().map(|&at| patches[at].key), number);
        }
    }

    /// The plane that a point belongs to.
    pub(crate) fn of(&self, point: &Point) -> Option<u32> {
        let plane = self.plane_of(point);
        if plane.is_some() || point.laser == Laser::Vertical {
            return plane;
        }
        self.line_of(point)
    }

    fn plane_of(&self, point: &Point) -> Option<u32> {
        let regions = self.cells.get(key_of(point.at_m, self.voxel_m));
        let planes = regions.filter_map(|region| match &self.regions[region as usize] {
            Region::Whole(plane) => *plane,
            Region::Pieces(pieces) => pieces.get(&point.piece).copied(),
        });
        self.nearest(planes, point)
    }

    /// The plane of a line that a point of the horizontal laser belongs to.
    fn line_of(&self, point: &Point) -> Option<u32> {
        self.nearest(self.line_cells.get(self.slab_of(point)), point)
    }

    fn slab_of(&self, point: &Point) -> Key {
        let [x, y, z] = point.at_m;
        key([cell(x, self.voxel_m), cell(y, self.voxel_m), cell(z, SLAB_M)])
    }

    fn nearest(&self, planes: impl Iterator<Item = u32>, point: &Point) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        for plane in planes {
            let away_m = self.list[plane as usize].distance_m(point.at_m).abs();
            if away_m < self.gate_m && best.is_none_or(|(min_m, _)| away_m < min_m) {
                best = Some((away_m, plane));
            }
        }
        best.map(|(_, plane)| plane)
    }
}

/// The patches of each region.
fn members(patches: &[Patch], count: usize) -> Vec<Vec<usize>> {
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (number, patch) in patches.iter().enumerate() {
        patch.region.iter().for_each(|&region| members[region as usize].push(number));
    }
    members
}

/// Lets the cells around some find a region or plane.
fn register(cells: &mut VoxelMap, keys: impl Iterator<Item = Key>, number: u32) {
    keys.flat_map(around).for_each(|neighbor| cells.push(neighbor, number));
}

fn moments_of(points: &[Point], which: &[(Key, u32)], flat: bool) -> (Moments, [f64; 3]) {
    let origin_m = which.first().map_or([0.0; 3], |(_, at)| points[*at as usize].at_m);
    let mut moments = Moments::default();
    for (_, at) in which {
        let mut at_m = points[*at as usize].at_m;
        if flat {
            at_m[2] = origin_m[2];
        }
        moments.add(at_m, origin_m);
    }
    (moments, origin_m)
}

fn flat_voxels(points: &[Point], order: &[(Key, u32)], search: &Search) -> Vec<Patch> {
    let mut patches = Vec::new();
    for points_of in runs(order) {
        if points_of.len() < VOXEL_POINTS {
            continue;
        }
        let (moments, origin_m) = moments_of(points, &order[points_of.clone()], false);
        let (variances, axes) = moments.spread();
        if variances[0].sqrt() > search.thickness_m || variances[1].sqrt() < MIN_SPREAD_M {
            continue;
        }
        let middle_m = plus(moments.middle().into(), origin_m);
        let key = order[points_of.start].0;
        patches.push(Patch { key, points: points_of, normal: axes[0].into(), middle_m, region: None });
    }
    patches
}

/// Joins patches that go on in one plane, beginning with the fullest; gives the number of regions.
fn grow(patches: &mut [Patch], search: &Search) -> usize {
    let mut index = VoxelMap::default();
    (0..).zip(patches.iter()).for_each(|(number, patch)| index.push(patch.key, number));
    let mut seeds: Vec<usize> = (0..patches.len()).collect();
    seeds.sort_by_key(|&number| (std::cmp::Reverse(patches[number].points.len()), number));
    let (mut count, cosine) = (0, search.angle_rad.portable_cos());
    for seed in seeds {
        if patches[seed].region.is_some() {
            continue;
        }
        let region = Some(count as u32);
        count += 1;
        patches[seed].region = region;
        // The plane of what was joined so far: means, weighted by points.
        let mut weight = patches[seed].points.len() as f64;
        let (mut normal, mut middle_m) = (patches[seed].normal, patches[seed].middle_m);
        let mut open = std::collections::VecDeque::from([seed]);
        while let Some(at) = open.pop_front() {
            for neighbor in around(patches[at].key) {
                let Some(other) = index.get(neighbor).next().map(|other| other as usize) else { continue };
                let patch = &patches[other];
                let turn = dot(patch.normal, normal);
                let step_m = dot(normal, minus(patch.middle_m, middle_m)).abs();
                let near_m = dot(patches[at].normal, minus(patch.middle_m, patches[at].middle_m)).abs();
                let goes_on = turn.abs() > cosine && near_m < search.step_m && step_m < 2.0 * search.step_m;
                if patch.region.is_some() || !goes_on {
                    continue;
                }
                let own = patch.points.len() as f64;
                let sign = if turn < 0.0 { -own } else { own };
                let mix = |a: [f64; 3], b: [f64; 3], by: f64| {
                    std::array::from_fn(|axis| (weight * a[axis] + by * b[axis]) / (weight + own))
                };
                (normal, middle_m) =
                    (unit(mix(normal, patch.normal, sign)), mix(middle_m, patch.middle_m, own));
                weight += own;
                patches[other].region = region;
                open.push_back(other);
            }
        }
    }
    count
}
