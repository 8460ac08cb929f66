//! A polygon with holes as one ring: each hole is joined to the ring by a cut of no width, walked to and fro.
//!
//! For formats whose faces have one ring. A cut joins the nearest two corners that see each other, inside of
//! both their angles (the in-cone test of O'Rourke, Computational Geometry in C, section 1.6).

use crate::model::PlanarPolygon;
use biplane_geometry::polygon_area;
use biplane_geometry::vec3::{cross, dot, norm};

type Point = [f64; 2];

/// The polygon as one ring of corners in `map`; `None` when some hole cannot be reached by a cut.
pub(crate) fn single_ring(polygon: &PlanarPolygon, normal: [f64; 3]) -> Option<Vec<[f64; 3]>> {
    let flat = Flat::of(polygon, normal);
    let mut ring: Vec<usize> = (0..polygon.outer_m.len()).collect();
    let mut first = ring.len();
    let mut holes: Vec<Vec<usize>> = Vec::new();
    for hole in &polygon.holes_m {
        holes.push((first..first + hole.len()).collect());
        first += hole.len();
    }
    // From right to left, so that each hole finds what it can reach already in the ring.
    let right = |hole: &Vec<usize>| hole.iter().map(|&i| flat.points[i][0]).fold(f64::NEG_INFINITY, f64::max);
    holes.sort_by(|a, b| right(b).total_cmp(&right(a)));
    while !holes.is_empty() {
        let hole = holes.remove(0);
        let (at, from) = flat.nearest_cut(&ring, &hole, &holes)?;
        let mut spliced = ring[..=at].to_vec();
        spliced.extend_from_slice(&hole[from..]);
        spliced.extend_from_slice(&hole[..=from]);
        spliced.extend_from_slice(&ring[at..]);
        ring = spliced;
    }
    let corners: Vec<[f64; 3]> =
        polygon.outer_m.iter().chain(polygon.holes_m.iter().flatten()).copied().collect();
    ring.into_iter().map(|index| corners.get(index).copied()).collect()
}

/// All corners of a polygon, outer ring first, in two axes of its plane.
struct Flat {
    points: Vec<Point>,
}

impl Flat {
    fn of(polygon: &PlanarPolygon, normal: [f64; 3]) -> Self {
        let [u, v] = axes(normal);
        let corners = polygon.outer_m.iter().chain(polygon.holes_m.iter().flatten());
        Self { points: corners.map(|p| [dot(*p, u), dot(*p, v)]).collect() }
    }

    /// The positions in `ring` and `hole` of the shortest cut that crosses nothing.
    fn nearest_cut(&self, ring: &[usize], hole: &[usize], others: &[Vec<usize>]) -> Option<(usize, usize)> {
        let mut cuts: Vec<(f64, usize, usize)> = Vec::with_capacity(ring.len() * hole.len());
        for (at, &i) in ring.iter().enumerate() {
            for (from, &j) in hole.iter().enumerate() {
                let (a, b) = (self.points[i], self.points[j]);
                cuts.push(((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2), at, from));
            }
        }
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let free = |at: usize, from: usize| {
            let (a, b) = (self.points[ring[at]], self.points[hole[from]]);
            self.in_cone(ring, at, b)
                && self.in_cone(hole, from, a)
                && !self.crosses(ring, a, b)
                && !self.crosses(hole, a, b)
                && !others.iter().any(|other| self.crosses(other, a, b))
        };
        cuts.into_iter().find(|&(_, at, from)| free(at, from)).map(|(_, at, from)| (at, from))
    }

    /// Whether the direction from the corner at a position of a ring towards `to` leads inside.
    fn in_cone(&self, ring: &[usize], at: usize, to: Point) -> bool {
        let count = ring.len();
        let [before, here, after] =
            [at + count - 1, at, at + 1].map(|position| self.points[ring[position % count]]);
        if turn(here, after, before) >= 0.0 {
            turn(here, to, before) > 0.0 && turn(to, here, after) > 0.0
        } else {
            !(turn(here, to, after) >= 0.0 && turn(to, here, before) >= 0.0)
        }
    }

    /// Whether the segment meets an edge of a ring elsewhere than at its own ends.
    fn crosses(&self, ring: &[usize], a: Point, b: Point) -> bool {
        (0..ring.len()).any(|index| {
            let (c, d) = (self.points[ring[index]], self.points[ring[(index + 1) % ring.len()]]);
            if [c, d].iter().any(|end| *end == a || *end == b) {
                return false;
            }
            let (abc, abd) = (turn(a, b, c), turn(a, b, d));
            let (cda, cdb) = (turn(c, d, a), turn(c, d, b));
            abc * abd <= 0.0 && cda * cdb <= 0.0 && !(abc == 0.0 && abd == 0.0 && apart(a, b, c, d))
        })
    }
}

/// Whether two segments of one line have no point in common.
fn apart(a: Point, b: Point, c: Point, d: Point) -> bool {
    [0, 1].iter().any(|&axis| {
        a[axis].max(b[axis]) < c[axis].min(d[axis]) || c[axis].max(d[axis]) < a[axis].min(b[axis])
    })
}

/// Twice the area of a triangle, positive when it turns left.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    polygon_area::doubled_flat_triangle([a, b, c])
}

/// Two axes of a plane that make a right-handed frame with its normal.
fn axes([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    // Crossed with the coordinate axis that the normal is farthest from.
    let u = if x.abs() <= y.abs() && x.abs() <= z.abs() {
        [0.0, -z, y]
    } else if y.abs() <= z.abs() {
        [z, 0.0, -x]
    } else {
        [-y, x, 0.0]
    };
    let length = norm(u).max(f64::MIN_POSITIVE);
    let u = u.map(|value| value / length);
    [u, cross([x, y, z], u)]
}

#[cfg(test)]
mod tests {
    use super::single_ring;
    use crate::model::PlanarPolygon;

    fn area(ring: &[[f64; 3]]) -> f64 {
        let twice: f64 = (0..ring.len())
            .map(|i| (ring[i], ring[(i + 1) % ring.len()]))
            .map(|(p, q)| p[0] * q[1] - q[0] * p[1])
            .sum();
        twice / 2.0
    }

    fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Vec<[f64; 3]> {
        vec![[x, y, 1.0], [x + width, y, 1.0], [x + width, y + height, 1.0], [x, y + height, 1.0]]
    }

    fn hole(x: f64, y: f64, width: f64, height: f64) -> Vec<[f64; 3]> {
        rectangle(x, y, width, height).into_iter().rev().collect()
    }

    #[test]
    fn a_wall_with_many_windows_becomes_one_ring_of_the_same_area() {
        let mut holes_m = Vec::new();
        for row in 0..4 {
            for column in 0..9 {
                holes_m.push(hole(1.0 + 2.0 * f64::from(column), 1.0 + 2.0 * f64::from(row), 1.0, 1.0));
            }
        }
        let polygon = PlanarPolygon { plane: 0, outer_m: rectangle(0.0, 0.0, 19.0, 9.0), holes_m };
        let ring = single_ring(&polygon, [0.0, 0.0, 1.0]).unwrap();
        assert_eq!(ring.len(), 4 + 36 * (4 + 2));
        assert!((area(&ring) - (19.0 * 9.0 - 36.0)).abs() < 1e-9);
    }

    #[test]
    fn cuts_cross_neither_the_ring_nor_each_other() {
        // A comb: the nearest corners of ring and hole do not see each other through the teeth.
        let comb = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [6.1, 5.0], [6.0, 1.0], [5.9, 5.0], [0.0, 5.0]];
        let outer_m = comb.map(|[x, y]| [x, y, 0.0]).to_vec();
        let holes_m = vec![hole(3.0, 1.0, 2.5, 3.0), hole(7.0, 1.0, 2.0, 3.0)];
        let polygon = PlanarPolygon { plane: 0, outer_m, holes_m };
        let ring = single_ring(&polygon, [0.0, 0.0, 1.0]).unwrap();
        assert!((area(&ring) - (area(&polygon.outer_m) - 7.5 - 6.0)).abs() < 1e-9);
        // No two edges cross properly.
        let turn = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let edge = |i: usize| (ring[i], ring[(i + 1) % ring.len()]);
        for i in 0..ring.len() {
            for j in 0..i {
                let ((a, b), (c, d)) = (edge(i), edge(j));
                let proper = turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0;
                assert!(!proper, "{a:?} {b:?} crosses {c:?} {d:?}");
            }
        }
    }

    #[test]
    fn a_hole_outside_of_its_polygon_is_not_cut() {
        let polygon = PlanarPolygon {
            plane: 0,
            outer_m: rectangle(0.0, 0.0, 1.0, 1.0),
            holes_m: vec![hole(3.0, 0.2, 0.5, 0.5)],
        };
        assert_eq!(single_ring(&polygon, [0.0, 0.0, 1.0]), None);
    }
}
