//! Rays against triangles: the nearest surface along a beam.
//!
//! A tree of axis-aligned boxes (bounding volume hierarchy, split by the surface area heuristic over a few
//! bins) and the intersection of Moeller and Trumbore in double precision. A triangle is taken a hair larger
//! than it is, so that no ray slips between two triangles of one wall. Points and directions in the frame of
//! the triangles, meters.

use crate::world::vec3::{Vec3, cross, dot, sub, unit};

/// Where a ray first met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, meters (for a unit direction).
    pub range_m: f64,
    /// Index of the triangle.
    pub triangle: u32,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    corner: Vec3,
    edge1: Vec3,
    edge2: Vec3,
    index: u32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// First triangle of a leaf, or the right child of an inner node (the left one follows its parent).
    next: u32,
    /// Triangles in a leaf; 0 for an inner node.
    count: u32,
}

/// Triangles sorted for fast ray casting.
#[derive(Clone, Debug)]
pub struct Raycaster {
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
}

const LEAF_SIZE: usize = 4;
const BINS: usize = 12;
/// Share of an edge by which a triangle is enlarged.
const EDGE_SLACK: f64 = 1e-9;
/// Deepest tree that the traversal's stack holds; deeper nodes become leaves.
const MAX_DEPTH: usize = 60;

impl Raycaster {
    /// Sorts the triangles `faces` over `vertices_m`. A face that names a missing vertex or has no area is
    /// left out.
    #[must_use]
    pub fn new(vertices_m: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let corner = |i: u32| vertices_m.get(i as usize).copied();
        let mut triangles = Vec::with_capacity(faces.len());
        for (face, index) in faces.iter().zip(0u32..) {
            let (Some(a), Some(b), Some(c)) = (corner(face[0]), corner(face[1]), corner(face[2])) else {
                continue;
            };
            let (edge1, edge2) = (sub(b, a), sub(c, a));
            if dot(cross(edge1, edge2), cross(edge1, edge2)) > 0.0 {
                triangles.push(Triangle { corner: a, edge1, edge2, index });
            }
        }
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            let count = triangles.len();
            build(&mut nodes, &mut triangles, 0, count, 0);
        }
        Self { nodes, triangles }
    }

    /// The nearest triangle along the ray, not farther than `max_m`; `direction` of length 1.
    #[must_use]
    pub fn cast(&self, origin: Vec3, direction: Vec3, max_m: f64) -> Option<Hit> {
        let inverse = direction.map(|d| 1.0 / d);
        let mut best = Hit { range_m: max_m, triangle: u32::MAX };
        let mut stack = [0u32; MAX_DEPTH + 4];
        let mut depth = 0;
        let mut at = 0usize;
        if self.nodes.is_empty() || entry(&self.nodes[0], origin, inverse, max_m).is_none() {
            return None;
        }
        loop {
            let node = &self.nodes[at];
            if node.count > 0 {
                let first = node.next as usize;
                for triangle in &self.triangles[first..first + node.count as usize] {
                    if let Some(range_m) = meet(triangle, origin, direction)
                        && range_m < best.range_m
                    {
                        best = Hit { range_m, triangle: triangle.index };
                    }
                }
            } else {
                let (left, right) = (at + 1, node.next as usize);
                let enter_left = entry(&self.nodes[left], origin, inverse, best.range_m);
                let enter_right = entry(&self.nodes[right], origin, inverse, best.range_m);
                match (enter_left, enter_right) {
                    (Some(l), Some(r)) => {
                        let (near, far) = if l <= r { (left, right) } else { (right, left) };
                        stack[depth] = far as u32;
                        depth += 1;
                        at = near;
                        continue;
                    }
                    (Some(_), None) => {
                        at = left;
                        continue;
                    }
                    (None, Some(_)) => {
                        at = right;
                        continue;
                    }
                    (None, None) => {}
                }
            }
            if depth == 0 {
                break;
            }
            depth -= 1;
            at = stack[depth] as usize;
        }
        (best.triangle != u32::MAX).then_some(best)
    }

    /// How many triangles are in the tree.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is nothing to hit.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }
}

/// Distance at which the ray enters the box, if it does before `max_m`. NaN (0 times infinity) never rejects
/// a box.
#[inline(always)]
fn entry(node: &Node, origin: Vec3, inverse: Vec3, max_m: f64) -> Option<f64> {
    let mut enter = 0.0_f64;
    let mut leave = max_m;
    for axis in 0..3 {
        let a = (node.low[axis] - origin[axis]) * inverse[axis];
        let b = (node.high[axis] - origin[axis]) * inverse[axis];
        let (near, far) = if inverse[axis] >= 0.0 { (a, b) } else { (b, a) };
        if near > enter {
            enter = near;
        }
        if far < leave {
            leave = far;
        }
    }
    (enter <= leave).then_some(enter)
}

#[inline(always)]
fn meet(triangle: &Triangle, origin: Vec3, direction: Vec3) -> Option<f64> {
    let p = cross(direction, triangle.edge2);
    let determinant = dot(triangle.edge1, p);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = sub(origin, triangle.corner);
    let u = dot(s, p) * inverse;
    if !(-EDGE_SLACK..=1.0 + EDGE_SLACK).contains(&u) {
        return None;
    }
    let q = cross(s, triangle.edge1);
    let v = dot(direction, q) * inverse;
    if v < -EDGE_SLACK || u + v > 1.0 + EDGE_SLACK {
        return None;
    }
    let range = dot(triangle.edge2, q) * inverse;
    (range > 0.0).then_some(range)
}

fn bounds(triangle: &Triangle) -> (Vec3, Vec3) {
    let (mut low, mut high) = (triangle.corner, triangle.corner);
    for edge in [triangle.edge1, triangle.edge2] {
        for axis in 0..3 {
            let at = triangle.corner[axis] + edge[axis];
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    (low, high)
}

/// Three times the center: its order is what counts.
fn center(triangle: &Triangle, axis: usize) -> f64 {
    3.0 * triangle.corner[axis] + triangle.edge1[axis] + triangle.edge2[axis]
}

const NOTHING: (Vec3, Vec3) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);

fn join(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    let mut out = a;
    for axis in 0..3 {
        out.0[axis] = a.0[axis].min(b.0[axis]);
        out.1[axis] = a.1[axis].max(b.1[axis]);
    }
    out
}

fn half_area(bounds: (Vec3, Vec3)) -> f64 {
    let d = sub(bounds.1, bounds.0);
    if d[0] < 0.0 { 0.0 } else { d[0] * d[1] + d[1] * d[2] + d[2] * d[0] }
}

/// Appends the subtree over `triangles[first..first + count]`.
fn build(nodes: &mut Vec<Node>, triangles: &mut [Triangle], first: usize, count: usize, depth: usize) {
    let range = &mut triangles[first..first + count];
    let (low, high) = range.iter().map(bounds).fold(NOTHING, join);
    let at = nodes.len();
    // A box of a flat wall has no thickness: rounding must not push the wall out of its own box.
    let slack = 1e-9 * (1.0 + low.iter().chain(&high).fold(0.0_f64, |m, v| m.max(v.abs())));
    let (low, high) = (low.map(|v| v - slack), high.map(|v| v + slack));
    nodes.push(Node { low, high, next: first as u32, count: count as u32 });
    if count <= LEAF_SIZE || depth + 1 >= MAX_DEPTH {
        return;
    }
    let Some((axis, threshold)) = best_split(range) else { return };
    range.sort_by(|a, b| {
        (center(a, axis) >= threshold).cmp(&(center(b, axis) >= threshold)).then(a.index.cmp(&b.index))
    });
    let left = range.iter().filter(|t| center(t, axis) < threshold).count();
    if left == 0 || left == count {
        return;
    }
    build(nodes, triangles, first, left, depth + 1);
    let right = nodes.len() as u32;
    build(nodes, triangles, first + left, count - left, depth + 1);
    nodes[at] = Node { low, high, next: right, count: 0 };
}

/// The cheapest of a few splits by the surface area heuristic: axis and threshold on `center`.
fn best_split(triangles: &[Triangle]) -> Option<(usize, f64)> {
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..3 {
        let (low, high) = triangles
            .iter()
            .map(|t| center(t, axis))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
        if high <= low {
            continue;
        }
        let mut bins = [(NOTHING, 0usize); BINS];
        for t in triangles {
            let bin = ((center(t, axis) - low) / (high - low) * BINS as f64) as usize;
            let bin = &mut bins[bin.min(BINS - 1)];
            *bin = (join(bin.0, bounds(t)), bin.1 + 1);
        }
        for cut in 1..BINS {
            let side = |part: &[((Vec3, Vec3), usize)]| {
                part.iter().fold((NOTHING, 0), |sum, bin| (join(sum.0, bin.0), sum.1 + bin.1))
            };
            let (left, right) = (side(&bins[..cut]), side(&bins[cut..]));
            let cost = half_area(left.0) * left.1 as f64 + half_area(right.0) * right.1 as f64;
            if left.1 > 0 && right.1 > 0 && best.is_none_or(|(lowest, _, _)| cost < lowest) {
                best = Some((cost, axis, low + (high - low) * cut as f64 / BINS as f64));
            }
        }
    }
    best.map(|(_, axis, threshold)| (axis, threshold))
}

/// The unit normal of a face, by the right-hand rule over its corners; zero for a face without area.
#[must_use]
pub fn normal(corners_m: [Vec3; 3]) -> Vec3 {
    unit(cross(sub(corners_m[1], corners_m[0]), sub(corners_m[2], corners_m[0])))
}

#[cfg(test)]
mod tests {
    use super::{Raycaster, Vec3};
    use crate::rng::Rng;
    use crate::world::vec3::{add, cross, dot, scale, sub, unit};

    fn random_direction(rng: &mut Rng) -> Vec3 {
        unit([rng.normal(), rng.normal(), rng.normal()])
    }

    fn triangle_soup(count: u32, size: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut rng = Rng::new(7, 0, 0);
        let mut vertices = Vec::new();
        for _ in 0..count {
            let center = [0, 1, 2].map(|_| rng.between(-5.0, 5.0));
            for _ in 0..3 {
                vertices.push(add(center, scale(random_direction(&mut rng), size)));
            }
        }
        (vertices, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    /// Cuts the triangle's plane, then asks on which side of each edge the point lies: another formula than
    /// the caster's.
    fn brute_force(vertices: &[Vec3], faces: &[[u32; 3]], origin: Vec3, direction: Vec3) -> Option<f64> {
        let mut best: Option<f64> = None;
        for face in faces {
            let [a, b, c] = face.map(|i| vertices[i as usize]);
            let normal = cross(sub(b, a), sub(c, a));
            let range = dot(normal, sub(a, origin)) / dot(normal, direction);
            let at = add(origin, scale(direction, range));
            let inside = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|(p, q)| dot(normal, cross(sub(*q, *p), sub(at, *p))) >= 0.0);
            if range > 0.0 && inside && best.is_none_or(|b| range < b) {
                best = Some(range);
            }
        }
        best
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        for (count, size) in [(1, 2.0), (5, 1.0), (600, 0.4), (2000, 0.3)] {
            let (vertices, faces) = triangle_soup(count, size);
            let caster = Raycaster::new(&vertices, &faces);
            let mut rng = Rng::new(8, 0, 0);
            let mut hits = 0;
            for _ in 0..400 {
                let origin = [0, 1, 2].map(|_| rng.between(-6.0, 6.0));
                let direction = random_direction(&mut rng);
                let expected = brute_force(&vertices, &faces, origin, direction);
                let found = caster.cast(origin, direction, f64::INFINITY).map(|hit| hit.range_m);
                match (expected, found) {
                    (Some(e), Some(f)) => assert!((e - f).abs() < 1e-9, "{e} {f}"),
                    (e, f) => assert_eq!(e, f),
                }
                hits += usize::from(found.is_some());
            }
            assert!(count < 600 || hits > 30, "{hits}");
        }
    }

    #[test]
    fn rays_along_the_axes_and_through_shared_edges_do_not_slip_through_a_wall() {
        // A flat wall of 20 x 20 squares at x = 3, seen head on through every corner, edge and diagonal of
        // its squares.
        let n = 20u32;
        let vertices: Vec<Vec3> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| [3.0, f64::from(i) * 0.1 - 1.0, f64::from(j) * 0.1 - 1.0]))
            .collect();
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let faces: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            })
            .collect();
        let caster = Raycaster::new(&vertices, &faces);
        for i in 1..40 {
            for j in 1..40 {
                let (y, z) = (f64::from(i) * 0.05 - 1.0, f64::from(j) * 0.05 - 1.0);
                let straight = caster.cast([0.0, y, z], [1.0, 0.0, 0.0], 100.0);
                assert!(straight.is_some_and(|hit| (hit.range_m - 3.0).abs() < 1e-12), "{y} {z}");
                let slanted = caster.cast([0.0; 3], unit([3.0, y, z]), 100.0);
                assert!(slanted.is_some(), "{y} {z}");
            }
        }
    }

    #[test]
    fn a_surface_beyond_the_limit_or_behind_is_not_hit() {
        let vertices = [[5.0, -1.0, -1.0], [5.0, 1.0, -1.0], [5.0, 0.0, 1.0]];
        let caster = Raycaster::new(&vertices, &[[0, 1, 2], [0, 0, 1], [0, 1, 99]]);
        assert_eq!(caster.len(), 1, "faces without area or with a missing vertex are left out");
        assert!(caster.cast([0.0; 3], [1.0, 0.0, 0.0], 5.1).is_some());
        assert!(caster.cast([0.0; 3], [1.0, 0.0, 0.0], 4.9).is_none());
        assert!(caster.cast([0.0; 3], [-1.0, 0.0, 0.0], 100.0).is_none());
        assert!(Raycaster::new(&[], &[]).cast([0.0; 3], [1.0, 0.0, 0.0], 5.0).is_none());
    }
}
