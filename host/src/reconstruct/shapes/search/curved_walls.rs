//! Large cylinders, of which the search for planes has made strips: two strips side by side whose normals
//! turn a little are a guess. Meters.

use super::circle::algebraic;
use super::guesses::fitted;
use super::patches::{Patch, Patches, width_m};
use crate::model::Cloud;
use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
use crate::reconstruct::shapes::fit::circle_fit::fit;
use crate::reconstruct::shapes::fit::judge::Accepted;
use crate::reconstruct::shapes::fit::sample::Sample;
use crate::reconstruct::shapes::fit::surface::{Evidence, ON_DEVIATIONS, Rejected};
use crate::reconstruct::shapes::params::ShapeParams;
use biplane_geometry::vec3::{cross, dot, norm, unit};

/// Sines of the angles between the normals of two strips of one wall.
const MIN_SINE: f64 = 0.07;
const MAX_SINE: f64 = 0.95;
/// Strips are no wider than this: at the largest radius the noise allows so much.
const MAX_WIDTH_M: f64 = 4.0;
/// An axis within this sine of upright is upright: walls are.
const UPRIGHT_SINE: f64 = 0.15;
/// Points of a strip that a guess is fitted to.
const MAX_FITTED: usize = 150;
/// A strip belongs to a cylinder when so many of its points are on it.
const MIN_SHARE: f64 = 0.6;
/// Smallest radius of a guess; smaller ones are found among the points themselves.
const MIN_RADIUS_M: f64 = 0.3;
/// How often strips are gathered anew.
const ROUNDS: usize = 5;

/// A cylinder of strips, its points by their index in the cloud.
pub(crate) struct Curved {
    pub accepted: Accepted,
    pub patches: Vec<u32>,
}

impl Curved {
    /// Whether it is one that only strips show. A pipe that came out of the strips on one side of it has
    /// another side, which is found among the points.
    pub(crate) fn is_wide(&self) -> bool {
        self.accepted.tube.radius_m >= MIN_RADIUS_M
    }
}

/// Finds the cylinders of a cloud's strips.
pub(crate) fn find(params: &ShapeParams, cloud: &Cloud, divided: &Patches, sigma_m: f64) -> Vec<Curved> {
    let patches = &divided.patches;
    let mut neighbors = vec![Vec::new(); patches.len()];
    for (a, b) in &divided.beside {
        neighbors[*a as usize].push(*b);
        neighbors[*b as usize].push(*a);
    }
    let size =
        |pair: &(u32, u32)| patches[pair.0 as usize].points.len().min(patches[pair.1 as usize].points.len());
    let mut pairs: Vec<(u32, u32)> =
        divided.beside.iter().copied().filter(|pair| is_pair(patches, *pair)).collect();
    pairs.sort_by_key(|pair| (std::cmp::Reverse(size(pair)), *pair));
    let mut used = vec![false; patches.len()];
    let mut found = Vec::new();
    let samples_m = patches.iter().map(|patch| sample(cloud, patch)).collect();
    let work = Work { params, cloud, patches, neighbors: &neighbors, samples_m, sigma_m };
    for (a, b) in pairs {
        if used[a as usize] || used[b as usize] {
            continue;
        }
        let Some(start) = work.guess(a, b) else { continue };
        if start.radius_m > 1.5 * params.max_radius_m
            || ![a, b].iter().all(|patch| work.lies_on(&start, *patch))
        {
            continue;
        }
        let (tube, members) = work.gathered(start, [a, b], &used);
        if !(MIN_RADIUS_M..=params.max_radius_m).contains(&tube.radius_m) {
            continue;
        }
        if let Ok(accepted) = work.judged(tube, &members) {
            members.iter().for_each(|member| used[*member as usize] = true);
            found.push(Curved { accepted, patches: members });
        }
    }
    found
}

/// Whether two pieces may be strips of one cylinder.
fn is_pair(patches: &[Patch], (a, b): (u32, u32)) -> bool {
    let [a, b] = [a, b].map(|patch| &patches[patch as usize]);
    let sine = norm(cross(a.fit.normal, b.fit.normal));
    (MIN_SINE..=MAX_SINE).contains(&sine) && [a, b].iter().all(|patch| width_m(&patch.fit) <= MAX_WIDTH_M)
}

/// Some of the points of a piece.
fn sample(cloud: &Cloud, patch: &Patch) -> Vec<[f64; 3]> {
    let step = patch.points.len().div_ceil(MAX_FITTED).max(1);
    patch.points.iter().step_by(step).map(|point| cloud.points_m[*point as usize].map(f64::from)).collect()
}

struct Work<'a> {
    params: &'a ShapeParams,
    cloud: &'a Cloud,
    patches: &'a [Patch],
    neighbors: &'a [Vec<u32>],
    /// Some of the points of each piece.
    samples_m: Vec<Vec<[f64; 3]>>,
    sigma_m: f64,
}

impl Work<'_> {
    fn point_m(&self, point: u32) -> [f64; 3] {
        self.cloud.points_m[point as usize].map(f64::from)
    }

    /// Some of the points of pieces.
    fn some_m(&self, patches: &[u32]) -> Vec<[f64; 3]> {
        patches.iter().flat_map(|patch| &self.samples_m[*patch as usize]).copied().collect()
    }

    /// The cylinder through two strips.
    fn guess(&self, a: u32, b: u32) -> Option<Tube> {
        let [first, second] = [a, b].map(|patch| &self.patches[patch as usize]);
        let direction = unit(cross(first.fit.normal, second.fit.normal));
        let flat = (direction[0] * direction[0] + direction[1] * direction[1]).sqrt();
        let direction = if flat < UPRIGHT_SINE { [0.0, 0.0, 1.0] } else { direction };
        let axis = Axis::new(first.center_m, direction);
        let points = self.some_m(&[a, b]);
        let circle = algebraic(points.iter().map(|p| axis.local(*p)).map(|[x, y, _]| [x, y]))?;
        let tube = Tube { axis: axis.through(circle.center_m), radius_m: circle.radius_m };
        fit(tube, Sample::blind(&points), (self.sigma_m, 2.0 * ON_DEVIATIONS * self.sigma_m))
    }

    /// A cylinder with all strips that lie on it and hang together, fitted to them.
    fn gathered(&self, start: Tube, pair: [u32; 2], used: &[bool]) -> (Tube, Vec<u32>) {
        let mut tube = start;
        let mut members = pair.to_vec();
        let mut size = 0;
        for _ in 0..ROUNDS {
            members = self.on(&tube, pair, used);
            let points = self.some_m(&members);
            let limits = (self.sigma_m, ON_DEVIATIONS * self.sigma_m);
            tube = fit(tube, Sample::blind(&points), limits).unwrap_or(tube);
            if members.len() == size {
                break;
            }
            size = members.len();
        }
        (tube, members)
    }

    /// The strips on a cylinder that can be reached from a pair.
    fn on(&self, tube: &Tube, pair: [u32; 2], used: &[bool]) -> Vec<u32> {
        let mut members = pair.to_vec();
        let mut next = 0;
        while next < members.len() {
            for other in &self.neighbors[members[next] as usize] {
                if !used[*other as usize] && !members.contains(other) && self.lies_on(tube, *other) {
                    members.push(*other);
                }
            }
            next += 1;
        }
        members.sort_unstable();
        members
    }

    fn lies_on(&self, tube: &Tube, patch: u32) -> bool {
        let fit = &self.patches[patch as usize].fit;
        if dot(fit.normal, tube.axis.direction()).abs() > 0.3 || width_m(fit) > MAX_WIDTH_M {
            return false;
        }
        let points = &self.samples_m[patch as usize];
        let on = points.iter().filter(|p| tube.off_m(**p).abs() <= ON_DEVIATIONS * self.sigma_m).count();
        on as f64 >= MIN_SHARE * points.len() as f64
    }

    /// Judges a cylinder by the points of its strips; the indices of its points are those of the cloud.
    fn judged(&self, tube: Tube, members: &[u32]) -> Result<Accepted, Rejected> {
        let points: Vec<u32> =
            members.iter().flat_map(|member| &self.patches[*member as usize].points).copied().collect();
        let points_m: Vec<[f64; 3]> = points.iter().map(|point| self.point_m(*point)).collect();
        let origin_of = |point: &u32| Some(self.cloud.origin_of(*point as usize)?.map(f64::from));
        let origins_m: Vec<[f64; 3]> = points.iter().filter_map(origin_of).collect();
        let seen = Evidence { points_m: &points_m, origins_m: &origins_m, sigma_m: self.sigma_m };
        let mut accepted = fitted(self.params, tube, &seen)?;
        accepted.on.iter_mut().for_each(|i| *i = points[*i] as usize);
        Ok(accepted)
    }
}
