//! Neighbors share their corners: where two planes meet, both polygons have the same points on the common
//! line.
//!
//! Each polygon's border lies on its seams already, but corners of one may lie in the middle of an edge of
//! the other, which every program that draws triangles shows as a crack. Corners that nearly meet along a
//! seam become one; what is left is added to the other's edge. A corner on two seams is the common corner of
//! three planes, whichever of the three it is computed for. Frame `map`, meters.

use super::clearance::{CLEARANCE_STEPS, has_room};
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::{flat, rings};
use crate::reconstruct::polygons::outline::union::{Shape, doubled_area, repair};
use crate::reconstruct::polygons::plane_frame::{Frame, STEP_M};
use crate::reconstruct::polygons::seams::plane_intersection::{corner, foot_on_seam};
use biplane_geometry::vec3::distance as distance_m;
use std::collections::BTreeMap;

/// Corners that are nearer to a plane than this lie in it: what rounding to plane coordinates moves them.
pub(crate) const ON_PLANE_M: f64 = 3.0 * STEP_M;
/// Points of a seam nearer than this are one in any case.
const SAME_M: f64 = 2.0 * CLEARANCE_STEPS * STEP_M;

/// A corner of a polygon: polygon, ring (0 = outer), position in the ring.
type Place = (usize, usize, usize);

/// A corner on a seam.
#[derive(Clone, Copy)]
struct OnSeam {
    /// Along the seam, meters.
    along_m: f64,
    place: Place,
    /// It lies on two seams: it cannot move along one.
    fixed: bool,
}

/// Which planes meet each plane: those that a polygon of it has an edge on.
pub(crate) fn neighbors(planes: &[Plane], polygons: &[PlanarPolygon]) -> Vec<Vec<usize>> {
    let mut found = vec![Vec::new(); planes.len()];
    for polygon in polygons {
        let near = |p: &[f64; 3], other: usize| planes[other].distance_m(*p).abs() < ON_PLANE_M;
        for (a, b) in rings(polygon).flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1))) {
            for other in (0..planes.len()).filter(|other| *other != polygon.plane) {
                if near(a, other) && near(b, other) && !found[polygon.plane].contains(&other) {
                    found[polygon.plane].push(other);
                }
            }
        }
    }
    found
}

/// Makes polygons share their corners along the seams of `pairs` of planes. Corners move by at most `reach_m`
/// along a seam.
pub(crate) fn weld(planes: &[Plane], polygons: &mut [PlanarPolygon], pairs: &[(usize, usize)], reach_m: f64) {
    let mut by_plane = vec![Vec::new(); planes.len()];
    for (index, polygon) in polygons.iter().enumerate() {
        by_plane[polygon.plane].push(index);
    }
    let seams: Vec<Seam> = pairs.iter().filter_map(|pair| Seam::new(planes, *pair)).collect();
    let before = polygons.to_vec();
    let on_seams = place_exactly(planes, polygons, &seams, &by_plane);
    let moves = meeting(&seams, polygons, &on_seams, reach_m);
    apply(planes, polygons, &moves);
    for seam in &seams {
        share(seam, polygons, &by_plane);
    }
    // A tenth of a millimeter can be too much where rings touch: better a crack that nobody sees than a
    // polygon that is none.
    for (polygon, old) in polygons.iter_mut().zip(before) {
        if *polygon != old && !is_whole(&planes[polygon.plane], polygon) {
            *polygon = old;
        }
    }
}

fn ring_mut(polygon: &mut PlanarPolygon, ring: usize) -> &mut Vec<[f64; 3]> {
    if ring == 0 { &mut polygon.outer_m } else { &mut polygon.holes_m[ring - 1] }
}

/// The common line of two planes, the one with the smaller index first.
struct Seam {
    planes: [usize; 2],
    equations: [Plane; 2],
    at_m: [f64; 3],
    along: [f64; 3],
}

impl Seam {
    fn new(planes: &[Plane], (a, b): (usize, usize)) -> Option<Self> {
        let (a, b) = (a.min(b), a.max(b));
        let equations = [*planes.get(a)?, *planes.get(b)?];
        let (at_m, along) = crate::reconstruct::polygons::seams::plane_intersection::line(
            &equations[0],
            &equations[1],
            [0.0; 3],
        )?;
        Some(Self { planes: [a, b], equations, at_m, along })
    }

    fn along_m(&self, p: [f64; 3]) -> f64 {
        (0..3).map(|k| self.along[k] * (p[k] - self.at_m[k])).sum()
    }

    fn holds(&self, p: [f64; 3]) -> bool {
        foot_on_seam(&self.equations[0], &self.equations[1], p)
            .is_some_and(|foot| distance_m(foot, p) < 2.0 * ON_PLANE_M)
    }

    /// The corners on the seam of the polygons of either plane.
    fn corners(&self, polygons: &[PlanarPolygon], by_plane: &[Vec<usize>]) -> Vec<Place> {
        let mut found = Vec::new();
        for polygon in self.planes.iter().flat_map(|plane| &by_plane[*plane]) {
            for (number, ring) in rings(&polygons[*polygon]).enumerate() {
                found.extend(
                    (0..ring.len()).filter(|at| self.holds(ring[*at])).map(|at| (*polygon, number, at)),
                );
            }
        }
        found
    }

    /// Whether an edge of a polygon of either plane reaches the seam, which is where the other plane cuts it.
    fn reached_by(&self, plane: usize, [from, to]: [[f64; 3]; 2]) -> bool {
        let other = &self.equations[usize::from(plane == self.planes[0])];
        let (from_m, to_m) = (other.distance_m(from), other.distance_m(to));
        from_m.abs() < SAME_M || to_m.abs() < SAME_M || (from_m < 0.0) != (to_m < 0.0)
    }
}

/// Moves every corner on a seam exactly onto it, and those on two seams into the corner of three planes; says
/// which seams each is on.
fn place_exactly(
    planes: &[Plane],
    polygons: &mut [PlanarPolygon],
    seams: &[Seam],
    by_plane: &[Vec<usize>],
) -> BTreeMap<Place, Vec<usize>> {
    let mut on_seams: BTreeMap<Place, Vec<usize>> = BTreeMap::new();
    for (index, seam) in seams.iter().enumerate() {
        for place in seam.corners(polygons, by_plane) {
            on_seams.entry(place).or_default().push(index);
        }
    }
    for ((polygon, ring, at), on) in &mut on_seams {
        let mut three: Vec<usize> = on.iter().take(2).flat_map(|seam| seams[*seam].planes).collect();
        three.sort_unstable();
        three.dedup();
        let p = ring_mut(&mut polygons[*polygon], *ring)[*at];
        let first = &seams[on[0]].equations;
        let exact = match three.as_slice() {
            [a, b, c] => corner(&planes[*a], &planes[*b], &planes[*c]).filter(|x| distance_m(*x, p) < SAME_M),
            _ => None,
        };
        if exact.is_none() {
            on.truncate(1);
        }
        let at_m = exact.or_else(|| foot_on_seam(&first[0], &first[1], p)).unwrap_or(p);
        ring_mut(&mut polygons[*polygon], *ring)[*at] = at_m;
    }
    on_seams
}

/// Where corners go that nearly meet one of the other plane along their seam.
fn meeting(
    seams: &[Seam],
    polygons: &[PlanarPolygon],
    on_seams: &BTreeMap<Place, Vec<usize>>,
    reach_m: f64,
) -> BTreeMap<Place, [f64; 3]> {
    let mut by_seam: Vec<Vec<OnSeam>> = seams.iter().map(|_| Vec::new()).collect();
    for (place, on) in on_seams {
        for index in on {
            let p = rings(&polygons[place.0]).nth(place.1).map_or([0.0; 3], |ring| ring[place.2]);
            let seam = &seams[*index];
            by_seam[*index].push(OnSeam { along_m: seam.along_m(p), place: *place, fixed: on.len() > 1 });
        }
    }
    let mut moves = BTreeMap::new();
    for corners in &mut by_seam {
        corners.sort_by(|a, b| a.along_m.total_cmp(&b.along_m).then(a.place.cmp(&b.place)));
        let mut start = 0;
        while start < corners.len() {
            // A group grows while the next corner is near its first one and no polygon has two corners in it.
            let mut end = start + 1;
            while end < corners.len() {
                let (next, group) = (&corners[end], &corners[start..end]);
                let gap_m = next.along_m - group[0].along_m;
                let again = group.iter().any(|c| c.place.0 == next.place.0) || two_fixed(group, next);
                if gap_m > reach_m || (again && gap_m > SAME_M) {
                    break;
                }
                end += 1;
            }
            let group = &corners[start..end];
            let target = group.iter().find(|c| c.fixed).unwrap_or(&group[group.len() / 2]);
            let at_m =
                rings(&polygons[target.place.0]).nth(target.place.1).map_or([0.0; 3], |r| r[target.place.2]);
            let plane = |c: &OnSeam| polygons[c.place.0].plane;
            if group.iter().any(|c| plane(c) != plane(&group[0])) {
                moves.extend(group.iter().filter(|c| !c.fixed).map(|c| (c.place, at_m)));
            }
            start = end;
        }
    }
    moves
}

fn two_fixed(group: &[OnSeam], next: &OnSeam) -> bool {
    next.fixed && group.iter().any(|c| c.fixed && (c.along_m - next.along_m).abs() > STEP_M)
}

/// Moves corners, polygon by polygon, where the polygon stays one; otherwise only those that move by next to
/// nothing.
fn apply(planes: &[Plane], polygons: &mut [PlanarPolygon], moves: &BTreeMap<Place, [f64; 3]>) {
    let mut by_polygon: BTreeMap<usize, Vec<(Place, [f64; 3])>> = BTreeMap::new();
    for (place, to_m) in moves {
        by_polygon.entry(place.0).or_default().push((*place, *to_m));
    }
    for (index, moves) in by_polygon {
        let moved = |max_m: f64| {
            let mut polygon = polygons[index].clone();
            for ((_, ring, at), to_m) in &moves {
                let corner = &mut ring_mut(&mut polygon, *ring)[*at];
                if distance_m(*corner, *to_m) <= max_m {
                    *corner = *to_m;
                }
            }
            polygon.outer_m = without_repeats(&polygon.outer_m);
            polygon.holes_m = polygon.holes_m.iter().map(|ring| without_repeats(ring)).collect();
            polygon
        };
        let plane = &planes[polygons[index].plane];
        let found = [f64::INFINITY, SAME_M].map(moved).into_iter().find(|polygon| is_whole(plane, polygon));
        if let Some(polygon) = found {
            polygons[index] = polygon;
        }
    }
}

fn without_repeats(ring: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut out: Vec<[f64; 3]> = ring.to_vec();
    out.dedup();
    while out.len() > 1 && out.first() == out.last() {
        out.pop();
    }
    out
}

/// Whether a polygon is valid as it is, and stays so when its coordinates are rounded: the union of its rings
/// is the same again, and no corner is too close to an edge.
fn is_whole(plane: &Plane, polygon: &PlanarPolygon) -> bool {
    if rings(polygon).any(|ring| ring.len() < 3) {
        return false;
    }
    let frame = Frame::new(plane, polygon.outer_m[0]);
    let Some(shape) = flat(&frame, polygon) else { return false };
    let areas = |shape: &Shape| {
        let mut areas: Vec<i64> = shape.iter().map(|ring| doubled_area(ring)).collect();
        areas.sort_unstable();
        areas
    };
    match repair(std::slice::from_ref(&shape)).as_slice() {
        [one] => areas(one) == areas(&shape) && has_room(&shape),
        _ => false,
    }
}

/// Adds to each edge on the seam, and to each that ends or crosses there, the corners that polygons of the
/// other plane have within it.
fn share(seam: &Seam, polygons: &mut [PlanarPolygon], by_plane: &[Vec<usize>]) {
    let point = |place: Place| {
        let p = rings(&polygons[place.0]).nth(place.1).map_or([0.0; 3], |ring| ring[place.2]);
        (seam.along_m(p), p, polygons[place.0].plane)
    };
    let mut points: Vec<(f64, [f64; 3], usize)> =
        seam.corners(polygons, by_plane).into_iter().map(point).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    for index in seam.planes.iter().flat_map(|plane| &by_plane[*plane]) {
        let polygon = &mut polygons[*index];
        let plane = polygon.plane;
        for ring in std::iter::once(&mut polygon.outer_m).chain(&mut polygon.holes_m) {
            let mut shared = Vec::with_capacity(ring.len());
            for (from, to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                shared.push(*from);
                if seam.reached_by(plane, [*from, *to]) {
                    shared.extend(within(seam, plane, &points, [*from, *to]));
                }
            }
            *ring = shared;
        }
    }
}

/// The points of the other plane that lie in an edge, in its direction.
fn within(
    seam: &Seam,
    plane: usize,
    points: &[(f64, [f64; 3], usize)],
    [from, to]: [[f64; 3]; 2],
) -> Vec<[f64; 3]> {
    let (low, high) = (seam.along_m(from).min(seam.along_m(to)), seam.along_m(from).max(seam.along_m(to)));
    let first = points.partition_point(|point| point.0 < low - SAME_M);
    let length_m = distance_m(from, to);
    let edge: [f64; 3] = std::array::from_fn(|k| (to[k] - from[k]) / length_m);
    let mut found: Vec<(f64, [f64; 3])> = Vec::new();
    for (_, p, owner) in points[first..].iter().take_while(|point| point.0 <= high + SAME_M) {
        let along_m: f64 = (0..3).map(|k| edge[k] * (p[k] - from[k])).sum();
        let foot: [f64; 3] = std::array::from_fn(|k| from[k] + along_m * edge[k]);
        let inside = along_m > SAME_M && along_m < length_m - SAME_M;
        if *owner != plane && inside && distance_m(foot, *p) < SAME_M {
            found.push((along_m, *p));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.dedup_by(|a, b| a.1 == b.1);
    found.into_iter().map(|(_, p)| p).collect()
}

#[cfg(test)]
mod tests {
    use super::{neighbors, weld};
    use crate::model::Model;
    use crate::model::sample::{plane, polygon};
    use crate::reconstruct::polygons::seams::t_junctions;
    use crate::reconstruct::polygons::seams::t_junctions::TJunctions;
    use crate::reconstruct::polygons::validate;

    /// A floor, a wall behind it in two parts with a door between, a wall at its side. Corners are off by
    /// less than a millimeter where all three meet, by 2 cm at the door's left and by 20 cm at the wall's
    /// right end.
    fn room() -> Model {
        let planes =
            vec![plane([0.0, 0.0, 1.0], 0.0), plane([0.0, -1.0, 0.0], 0.0), plane([1.0, 0.0, 0.0], 0.0)];
        let off = 0.0001;
        let floor = [[0.0, 0.0, 0.0], [off, -3.0, 0.0], [4.0, -3.0, 0.0], [4.0, 0.0, 0.0], [1.02, 0.0, 0.0]];
        let left = [[off, 0.0, -off], [1.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.0, 0.0, 2.0]];
        let right = [[2.0, 0.0, 0.0], [3.8, 0.0, 0.0], [3.8, 0.0, 2.0], [2.0, 0.0, 2.0]];
        let side = [[0.0, -off, 0.0], [0.0, 0.0, 2.0], [0.0, -3.0, 2.0], [0.0, -3.0, 0.0]];
        let polygons = vec![polygon(0, &floor), polygon(1, &left), polygon(1, &right), polygon(2, &side)];
        Model { planes, polygons, ..Model::default() }
    }

    #[test]
    fn neighbors_share_corners_and_three_planes_meet_in_one_point() {
        let mut model = room();
        let met = neighbors(&model.planes, &model.polygons);
        assert_eq!(met.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 2]);
        assert!(
            t_junctions::find(&model)
                != TJunctions { shared_m: t_junctions::find(&model).shared_m, ..TJunctions::default() }
        );
        weld(&model.planes, &mut model.polygons, &[(0, 1), (0, 2), (1, 2)], 0.03);
        let found = t_junctions::find(&model);
        assert_eq!(found, TJunctions { shared_m: found.shared_m, ..TJunctions::default() });
        assert!(found.shared_m > 7.5, "{found:?}");
        // The corner of the room is one point, exactly on all planes; the wall's ends are corners of the
        // floor.
        for owner in [0, 1, 3] {
            assert!(model.polygons[owner].outer_m.contains(&[0.0; 3]), "{:?}", model.polygons[owner]);
        }
        let floor = &model.polygons[0].outer_m;
        assert!([2.0, 3.8].iter().all(|x| floor.iter().any(|p| (p[0] - x).abs() < 1e-9)), "{floor:?}");
        assert_eq!(floor.len(), 7);
        for polygon in &model.polygons {
            assert_eq!(validate::check(polygon, &model.planes[polygon.plane]), Ok(()));
        }
    }

    #[test]
    fn a_corner_that_cannot_move_without_crossing_its_own_border_stays() {
        // The floor has a slit 1 cm wide that ends at the seam; the wall's corner is 2 cm beyond it.
        let mut model = room();
        model.polygons.truncate(2);
        model.polygons[0].outer_m =
            vec![[0.0, -3.0, 0.0], [0.99, -3.0, 0.0], [0.98, 0.0, 0.0], [0.0, 0.0, 0.0]];
        let slit =
            [[0.985, -0.1, 0.0], [0.99, -3.0, 0.0], [4.0, -3.0, 0.0], [4.0, 0.0, 0.0], [0.99, 0.0, 0.0]];
        model.polygons.push(polygon(0, &slit));
        weld(&model.planes, &mut model.polygons, &[(0, 1)], 0.03);
        for polygon in &model.polygons {
            assert_eq!(validate::check(polygon, &model.planes[polygon.plane]), Ok(()));
        }
        assert_eq!(t_junctions::find(&model).corners_in_edges, 0);
    }
}
