//! Small patches of one plane in the midst of another that is there as well: the other's.
//!
//! Where two planes lie within each other's noise, poses a little off make patches of points choose the wrong
//! one. Each would be a polygon of its own in a hole of the wall. A patch hangs together in the raw mesh; it
//! joins the plane round it when it is near enough that nobody could tell. Frame `map`, meters.

use crate::model::area::triangle_area_m2;
use crate::model::{Cloud, Mesh, Plane};
use biplane_geometry::UnionFind;
use biplane_geometry::vec3::dot;
use std::collections::BTreeMap;

/// Larger patches are something of their own, square meters.
const MAX_M2: f64 = 0.25;
/// A patch joins a plane that this share of its neighbors is on.
const MIN_SHARE: f64 = 0.6;
/// Patches off the plane round it by no more than this many times that plane's noise, on average, lie in it.
const NOISES: f64 = 1.5;
/// Only planes closer to parallel than this (cosine; 30 degrees) are taken for each other.
const MIN_COSINE: f64 = 0.87;

/// How far a patch too small to be modeled may lie off the plane that takes it in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmallComponent {
    /// Largest area, square meters.
    pub area_m2: f64,
    /// Farthest mean distance, meters.
    pub off_m: f64,
}

/// One patch: points of one plane that hang together.
#[derive(Clone, Debug, Default)]
struct Patch {
    area_m2: f64,
    points: Vec<u32>,
    /// How often each other plane is beside it.
    beside: BTreeMap<i32, usize>,
}

/// The labels with those of small patches changed to the plane round them.
pub(crate) fn join(
    cloud: &Cloud,
    mesh: &Mesh,
    labels: &[i32],
    planes: &[Plane],
    small_component: SmallComponent,
) -> Vec<i32> {
    let mut out = labels.to_vec();
    for patch in patches(mesh, labels).values().filter(|patch| patch.area_m2 <= MAX_M2) {
        let all: usize = patch.beside.values().sum();
        let Some((label, count)) = patch.beside.iter().max_by_key(|(label, count)| (**count, -**label))
        else {
            continue;
        };
        let own = patch.points.first().and_then(|point| planes.get(labels[*point as usize] as usize));
        let (Some(own), Some(round)) = (own, planes.get(*label as usize)) else { continue };
        let off = |point: &u32| round.distance_m(cloud.points_m[*point as usize].map(f64::from));
        let off_m = (patch.points.iter().map(off).sum::<f64>() / patch.points.len() as f64).abs();
        let is_small = patch.area_m2 <= small_component.area_m2 && off_m <= small_component.off_m;
        let parallel = dot(own.normal, round.normal).abs() >= MIN_COSINE;
        if *count as f64 >= MIN_SHARE * all as f64 && (is_small || parallel && off_m <= NOISES * round.rms_m)
        {
            patch.points.iter().for_each(|point| out[*point as usize] = *label);
        }
    }
    out
}

/// All patches, by their first points.
fn patches(mesh: &Mesh, labels: &[i32]) -> BTreeMap<u32, Patch> {
    let label = |point: u32| labels.get(point as usize).copied().unwrap_or(-1);
    let sides = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let mut pieces = UnionFind::new(labels.len());
    for (a, b) in mesh.triangles.iter().flat_map(sides) {
        if label(a) >= 0 && label(a) == label(b) {
            pieces.join(a, b);
        }
    }
    let mut areas = vec![0.0; labels.len()];
    for triangle in &mesh.triangles {
        let third_m2 = triangle_area_m2(mesh, triangle) / 3.0;
        for corner in triangle.iter().filter(|corner| label(**corner) >= 0) {
            areas[pieces.root(*corner) as usize] += third_m2;
        }
    }
    let mut found: BTreeMap<u32, Patch> = BTreeMap::new();
    for point in (0..labels.len() as u32).filter(|point| label(*point) >= 0) {
        let root = pieces.root(point);
        let area_m2 = areas[root as usize];
        if area_m2 > 0.0 && area_m2 <= MAX_M2 {
            let patch = found.entry(root).or_default();
            patch.area_m2 = area_m2;
            patch.points.push(point);
        }
    }
    for (a, b) in mesh.triangles.iter().flat_map(sides).flat_map(|(a, b)| [(a, b), (b, a)]) {
        if label(a) >= 0
            && label(b) >= 0
            && label(a) != label(b)
            && let Some(patch) = found.get_mut(&pieces.root(a))
        {
            *patch.beside.entry(label(b)).or_default() += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{SmallComponent, join};
    use crate::model::{Cloud, Mesh, Plane};

    const SMALL_COMPONENT: SmallComponent = SmallComponent { area_m2: 0.02, off_m: 0.1 };

    /// A wall of 2 m by 2 m in cells of 5 cm; its points with row and column in `patch` are on the other
    /// plane, `off_m` before it.
    fn joined(patch: std::ops::Range<u32>, off_m: f32) -> bool {
        let inside = |k: u32| patch.contains(&(k / 41)) && patch.contains(&(k % 41));
        let at = |k: u32| {
            [0.05 * (k / 41) as f32, 1.0 - if inside(k) { off_m } else { 0.0 }, 0.05 * (k % 41) as f32]
        };
        let points_m: Vec<[f32; 3]> = (0..41 * 41).map(at).collect();
        let cells = (0..40 * 41).filter(|k| k % 41 < 40);
        let triangles = cells.flat_map(|k| [[k, k + 41, k + 42], [k, k + 42, k + 1]]).collect();
        let labels: Vec<i32> = (0..41 * 41).map(|k| i32::from(inside(k))).collect();
        let wall = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 3, rms_m: 0.015 };
        let before = Plane { offset_m: -1.0 + f64::from(off_m), ..wall };
        let cloud = Cloud { points_m: points_m.clone(), ..Cloud::default() };
        let mesh = Mesh { vertices_m: points_m, triangles };
        let left = join(&cloud, &mesh, &labels, &[wall, before], SMALL_COMPONENT);
        assert!(left == labels || left.iter().all(|label| *label == 0));
        left != labels
    }

    #[test]
    fn a_patch_within_the_noise_of_the_wall_round_it_is_the_walls() {
        assert!(joined(10..16, 0.01));
        assert!(!joined(10..16, 0.03), "a board of 25 cm before the wall by twice the noise");
        assert!(!joined(10..30, 0.01), "a meter square is no patch");
    }

    #[test]
    fn a_speck_joins_the_wall_though_it_stands_out() {
        assert!(joined(10..12, 0.05));
        assert!(!joined(10..12, 0.15));
    }
}
