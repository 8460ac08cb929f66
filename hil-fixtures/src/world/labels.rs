//! Plane labels for a mesh that has none: flat surfaces that hang together.
//!
//! Faces belong to one surface when their planes agree (direction within 0.1 degrees, offset within 2 mm) and
//! a chain of faces, each touching the next (within 1 cm), leads from one to the other: a wall made of
//! several building elements is one surface, two closed doors in line are two. A surface smaller than 1
//! square decimeter keeps [`NO_PLANE`]. Meters.

use super::mesh::{LabeledMesh, NO_PLANE};
use crate::world::raycast::normal;
use crate::world::vec3::{Vec3, cross, dot, length, scale, sub, unit};
use std::collections::BTreeMap;

/// Cosine of 0.1 degrees.
const SAME_DIRECTION: f64 = 0.999_998_5;
const SAME_OFFSET_M: f64 = 0.002;
const TOUCH_M: f64 = 0.01;
const SMALLEST_M2: f64 = 0.01;

/// Gives every face its label.
pub fn label_planes(mesh: &mut LabeledMesh) {
    let mut labels = vec![NO_PLANE; mesh.faces.len()];
    let mut next = 0;
    for (direction, members) in by_direction(mesh) {
        for group in by_offset(mesh, direction, members) {
            for surface in hanging_together(mesh, direction, &group) {
                let area: f64 = surface.iter().map(|face| area_m2(mesh.corners(*face))).sum();
                if area >= SMALLEST_M2 {
                    surface.iter().for_each(|face| labels[*face] = next);
                    next += 1;
                }
            }
        }
    }
    mesh.planes = labels;
}

fn area_m2([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * length(cross(sub(b, a), sub(c, a)))
}

/// The normal with a fixed sign, so that both sides of a sheet count as one plane.
fn undirected(n: Vec3) -> Vec3 {
    let first = n.iter().find(|v| v.abs() > 1e-6).copied().unwrap_or(1.0);
    if first < 0.0 { scale(n, -1.0) } else { n }
}

/// Faces with nearly the same normal, with that normal. Faces without area are left out.
fn by_direction(mesh: &LabeledMesh) -> Vec<(Vec3, Vec<usize>)> {
    const CELL: f64 = 0.004;
    let mut groups: Vec<(Vec3, Vec<usize>)> = Vec::new();
    let mut cells: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
    for face in 0..mesh.faces.len() {
        let n = normal(mesh.corners(face));
        if dot(n, n) < 0.5 {
            continue;
        }
        let n = undirected(n);
        let cell = n.map(|v| (v / CELL).floor() as i32);
        let near = (0..27).map(|k| [cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1]);
        let known = near
            .filter_map(|cell| cells.get(&cell))
            .flatten()
            .copied()
            .find(|group| dot(groups[*group].0, n).abs() > SAME_DIRECTION);
        if let Some(group) = known {
            groups[group].1.push(face);
        } else {
            cells.entry(cell).or_default().push(groups.len());
            groups.push((n, vec![face]));
        }
    }
    groups
}

/// Splits faces of one direction wherever their offsets leave a gap.
fn by_offset(mesh: &LabeledMesh, direction: Vec3, members: Vec<usize>) -> Vec<Vec<usize>> {
    let offset = |face: usize| mesh.corners(face).iter().map(|p| dot(direction, *p)).sum::<f64>() / 3.0;
    let mut sorted: Vec<(f64, usize)> = members.into_iter().map(|face| (offset(face), face)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (offset, face) in sorted {
        match groups.last_mut() {
            Some(group) if offset - last < SAME_OFFSET_M => group.push(face),
            _ => groups.push(vec![face]),
        }
        last = offset;
    }
    groups
}

/// Splits faces of one plane into those that hang together.
fn hanging_together(mesh: &LabeledMesh, direction: Vec3, group: &[usize]) -> Vec<Vec<usize>> {
    let helper = if direction[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let u = unit(cross(helper, direction));
    let v = cross(direction, u);
    let flat: Vec<Flat> =
        group.iter().map(|f| Flat::new(mesh.corners(*f).map(|p| [dot(u, p), dot(v, p)]))).collect();
    let mut order: Vec<usize> = (0..flat.len()).collect();
    order.sort_by(|a, b| flat[*a].low[0].total_cmp(&flat[*b].low[0]).then(a.cmp(b)));
    let mut sets = Sets::new(flat.len());
    let mut active: Vec<usize> = Vec::new();
    for &i in &order {
        active.retain(|&j| flat[j].high[0] + TOUCH_M >= flat[i].low[0]);
        for &j in &active {
            if sets.root(i) != sets.root(j) && flat[i].touches(&flat[j]) {
                sets.join(i, j);
            }
        }
        active.push(i);
    }
    let mut surfaces: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, face) in group.iter().enumerate() {
        surfaces.entry(sets.root(i)).or_default().push(*face);
    }
    surfaces.into_values().collect()
}

/// A face in its plane's own two axes.
struct Flat {
    corners: [[f64; 2]; 3],
    low: [f64; 2],
    high: [f64; 2],
}

impl Flat {
    fn new(corners: [[f64; 2]; 3]) -> Self {
        let low = [0, 1].map(|i| corners.iter().fold(f64::INFINITY, |m, c| m.min(c[i])));
        let high = [0, 1].map(|i| corners.iter().fold(f64::NEG_INFINITY, |m, c| m.max(c[i])));
        Self { corners, low, high }
    }

    fn touches(&self, other: &Self) -> bool {
        let apart = |i: usize| self.low[i] > other.high[i] + TOUCH_M || other.low[i] > self.high[i] + TOUCH_M;
        if apart(0) || apart(1) {
            return false;
        }
        if self.contains(other.corners[0]) || other.contains(self.corners[0]) {
            return true;
        }
        self.edges().any(|own| other.edges().any(|its| edge_distance(own, its) < TOUCH_M))
    }

    fn edges(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let [a, b, c] = self.corners;
        [[a, b], [b, c], [c, a]].into_iter()
    }

    fn contains(&self, p: [f64; 2]) -> bool {
        let turns: Vec<f64> = self.edges().map(|[a, b]| turn(a, b, p)).collect();
        turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
    }
}

fn turn(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

fn edge_distance(first: [[f64; 2]; 2], second: [[f64; 2]; 2]) -> f64 {
    let ([a, b], [c, d]) = (first, second);
    let crossing = turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0;
    if crossing {
        return 0.0;
    }
    let ends = [(c, first), (d, first), (a, second), (b, second)];
    ends.into_iter().map(|(p, edge)| point_distance(p, edge)).fold(f64::INFINITY, f64::min)
}

fn point_distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 { (along[0] * to[0] + along[1] * to[1]) / square } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (to[0] - share * along[0]).hypot(to[1] - share * along[1])
}

/// Disjoint sets of the numbers 0..n.
struct Sets(Vec<usize>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let (a, b) = (self.root(i), self.root(j));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::label_planes;
    use crate::world::built_in::builder::{Builder, Facing, Hole};
    use crate::world::mesh::{LabeledMesh, NO_PLANE};

    #[test]
    fn a_built_world_without_its_labels_gets_them_back() {
        let mut builder = Builder::default();
        let holes = [Hole { u: [1.0, 2.0], v: [0.0, 2.0] }, Hole { u: [4.0, 5.0], v: [1.0, 2.0] }];
        builder.within([3.0, 2.0, 0.0], 33.0, |b| {
            b.wall([0.0, 9.0], 0.3, 2.5, &holes);
            // Two doors in line, 2 m apart, in one plane.
            b.rect(Facing::Left, -0.1, [1.0, 2.0], [0.0, 2.0], &[]);
            b.rect(Facing::Left, -0.1, [4.0, 5.0], [1.0, 2.0], &[]);
        });
        let truth = builder.finish();
        let mut mesh = LabeledMesh { planes: vec![NO_PLANE; truth.planes.len()], ..truth.clone() };
        label_planes(&mut mesh);
        for i in 0..truth.faces.len() {
            for j in 0..truth.faces.len() {
                let same = (truth.planes[i] == truth.planes[j], mesh.planes[i] == mesh.planes[j]);
                assert_eq!(same.0, same.1, "faces {i} and {j}");
            }
        }
        assert!(mesh.planes.iter().all(|plane| *plane != NO_PLANE));
    }

    #[test]
    fn elements_that_abut_without_shared_corners_are_one_wall_and_crumbs_are_none() {
        let mut builder = Builder::default();
        builder.rect(Facing::Left, 0.0, [0.0, 2.0], [0.0, 2.0], &[]);
        builder.rect(Facing::Right, 0.001, [2.0, 3.0], [0.5, 1.5], &[]);
        builder.rect(Facing::Left, 0.0, [3.02, 4.0], [0.0, 2.0], &[]);
        builder.rect(Facing::Left, 5.0, [0.0, 0.05], [0.0, 0.05], &[]);
        // A sign flat on a wall, its edges far from the wall's.
        builder.rect(Facing::Left, 9.001, [2.0, 2.5], [0.3, 0.5], &[]);
        builder.rect(Facing::Left, 9.0, [0.0, 4.0], [0.0, 4.0], &[]);
        let mut mesh = builder.finish();
        label_planes(&mut mesh);
        assert_eq!(mesh.planes, vec![0, 0, 0, 0, 1, 1, NO_PLANE, NO_PLANE, 2, 2, 2, 2]);
    }
}
