//! The raw 3D mesh: consecutive points joined to triangles, only where they are close to each other.
//!
//! Frame `map`, meters. Source: the paper, section 2.3 ("to avoid closing holes such as doorways etc., we
//! only create a polygonal surface if the consecutive points are close to each other").

use crate::model::{Cloud, Mesh};
use crate::reconstruct::cloud::PosedScan;
use biplane_geometry::vec3::{cross, distance, dot, minus, norm};
use serde::Serialize;

/// When points are joined.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshParams {
    /// Longest edge of a triangle, meters. Larger: doorways and gaps behind edges are closed. Smaller: far,
    /// sparse walls fall apart.
    pub max_edge_m: f32,
}

impl Default for MeshParams {
    fn default() -> Self {
        Self { max_edge_m: 0.5 }
    }
}

/// Joins each four points (two beams of two consecutive scans) by the shorter diagonal, or three of them
/// where one is missing.
///
/// The vertices are the cloud's points in the same order. Triangles are counter-clockwise seen from the
/// laser. A cloud that is not organized gives no triangle.
pub(crate) fn join(params: &MeshParams, cloud: &Cloud) -> Mesh {
    let mut mesh = Mesh { vertices_m: cloud.points_m.clone(), triangles: Vec::new() };
    let organized = cloud.scan.len() == cloud.len() && cloud.beam.len() == cloud.len();
    if cloud.beams_per_scan == 0 || !organized {
        return mesh;
    }
    let mut rows = cloud.scan.chunk_by(|a, b| a == b).scan(0, |start, row| {
        let range = *start..*start + row.len();
        *start += row.len();
        Some(range)
    });
    let joiner = Joiner { cloud, max_edge_m: params.max_edge_m };
    let Some(mut previous) = rows.next().map(|row| joiner.spread(row)) else {
        return mesh;
    };
    for row in rows {
        let next = joiner.spread(row);
        if next.scan == previous.scan + 1 {
            joiner.join_rows(&previous, &next, &mut mesh.triangles);
        }
        previous = next;
    }
    // It is held until the end, and is as large as everything else.
    mesh.triangles.shrink_to_fit();
    mesh
}

/// One scan with a slot a beam: the point's index, or `NONE`.
struct Row {
    scan: u32,
    slots: Vec<u32>,
}

const NONE: u32 = u32::MAX;

struct Joiner<'a> {
    cloud: &'a Cloud,
    max_edge_m: f32,
}

impl Joiner<'_> {
    fn spread(&self, points: std::ops::Range<usize>) -> Row {
        let mut slots = vec![NONE; self.cloud.beams_per_scan];
        let scan = self.cloud.scan[points.start];
        for point in points {
            if let Some(slot) = slots.get_mut(usize::from(self.cloud.beam[point])) {
                *slot = point as u32;
            }
        }
        Row { scan, slots }
    }

    fn join_rows(&self, first: &Row, second: &Row, triangles: &mut Vec<[u32; 3]>) {
        for (left, right) in first.slots.windows(2).zip(second.slots.windows(2)) {
            let [a, b, c, d] = [left[0], right[0], right[1], left[1]];
            // The quad a b c d goes round: a and c are opposite, b and d are opposite.
            let halves = if self.length_m(a, c) <= self.length_m(b, d) {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            };
            triangles.extend(halves.into_iter().filter_map(|half| self.facing_the_laser(half)));
        }
    }

    fn length_m(&self, from: u32, to: u32) -> f32 {
        match (self.cloud.points_m.get(from as usize), self.cloud.points_m.get(to as usize)) {
            (Some(a), Some(b)) => distance(*a, *b),
            _ => f32::INFINITY,
        }
    }

    /// The triangle, turned towards the laser, when its edges are short enough and it has an area.
    fn facing_the_laser(&self, [a, b, c]: [u32; 3]) -> Option<[u32; 3]> {
        let close = |from, to| self.length_m(from, to) < self.max_edge_m;
        if !(close(a, b) && close(b, c) && close(c, a)) {
            return None;
        }
        let [p, q, r] = [a, b, c].map(|index| self.cloud.points_m[index as usize]);
        let normal = cross(minus(q, p), minus(r, p));
        if norm(normal) == 0.0 {
            return None;
        }
        let towards = minus(self.cloud.origin_of(a as usize)?, p);
        Some(if dot(normal, towards) >= 0.0 { [a, b, c] } else { [a, c, b] })
    }
}

/// Counts the triangles that [`join`] would make of a drive, for which nobody has to hold it.
pub(crate) struct TriangleCount<'a> {
    params: &'a MeshParams,
    /// A slot a beam of the scan before; what is missing is infinitely far away.
    previous: Vec<[f32; 3]>,
    next: Vec<[f32; 3]>,
    /// So many so far.
    pub triangles: usize,
}

impl<'a> TriangleCount<'a> {
    /// Before the first scan of a laser with so many beams.
    pub(crate) fn new(params: &'a MeshParams, beams_per_scan: usize) -> Self {
        let none = vec![[f32::NAN; 3]; beams_per_scan];
        Self { params, previous: none.clone(), next: none, triangles: 0 }
    }

    /// Counts those between a scan and the one before.
    pub(crate) fn push(&mut self, row: &PosedScan) {
        self.next.fill([f32::NAN; 3]);
        for (beam, point) in row.beams.iter().zip(&row.points_m) {
            self.next.get_mut(usize::from(*beam)).into_iter().for_each(|slot| *slot = *point);
        }
        for (left, right) in self.previous.windows(2).zip(self.next.windows(2)) {
            self.triangles += self.in_quad([left[0], right[0], right[1], left[1]]);
        }
        std::mem::swap(&mut self.previous, &mut self.next);
    }

    fn in_quad(&self, [a, b, c, d]: [[f32; 3]; 4]) -> usize {
        let length_m = |p: [f32; 3], q: [f32; 3]| {
            let length_m = distance(p, q);
            if length_m.is_nan() { f32::INFINITY } else { length_m }
        };
        let close = |p, q| length_m(p, q) < self.params.max_edge_m;
        let has_area = |p, q, r| norm(cross(minus(q, p), minus(r, p))) != 0.0;
        let counts =
            |[p, q, r]: [[f32; 3]; 3]| close(p, q) && close(q, r) && close(r, p) && has_area(p, q, r);
        let halves =
            if length_m(a, c) <= length_m(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        halves.into_iter().filter(|half| counts(*half)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::{MeshParams, TriangleCount, cross, dot, join, minus};
    use crate::model::Cloud;
    use crate::reconstruct::cloud::PosedScan;
    use crate::reconstruct::fixture::{corridor, drive};

    #[test]
    fn as_many_triangles_are_counted_as_are_made() {
        let params = MeshParams::default();
        for cloud in [wall(4, 5, &[]), wall(3, 3, &[(1, 1)]), drive(&corridor(), 60, 0.02, 5)] {
            let mut count = TriangleCount::new(&params, cloud.beams_per_scan);
            for scan in 0..cloud.origins_m.len() as u32 {
                let of_scan: Vec<usize> = (0..cloud.len()).filter(|k| cloud.scan[*k] == scan).collect();
                count.push(&PosedScan {
                    points_m: of_scan.iter().map(|k| cloud.points_m[*k]).collect(),
                    beams: of_scan.iter().map(|k| cloud.beam[*k]).collect(),
                    ..PosedScan::default()
                });
            }
            assert_eq!(count.triangles, join(&params, &cloud).triangles.len());
        }
    }

    /// A wall at y = 1 seen from the x axis: `scans` columns and `beams` rows 0.1 m apart, without the points
    /// in `missing`.
    fn wall(scans: u32, beams: u16, missing: &[(u32, u16)]) -> Cloud {
        let mut cloud = Cloud { beams_per_scan: usize::from(beams), ..Default::default() };
        for scan in 0..scans {
            cloud.origins_m.push([scan as f32 * 0.1, 0.0, 0.5]);
            for beam in (0..beams).filter(|beam| !missing.contains(&(scan, *beam))) {
                cloud.points_m.push([scan as f32 * 0.1, 1.0, f32::from(beam) * 0.1]);
                cloud.scan.push(scan);
                cloud.beam.push(beam);
            }
        }
        cloud
    }

    #[test]
    fn a_full_grid_gives_two_triangles_a_cell_all_facing_the_laser() {
        let cloud = wall(4, 5, &[]);
        let mesh = join(&MeshParams::default(), &cloud);
        assert_eq!(mesh.triangles.len(), 2 * 3 * 4);
        for [a, b, c] in mesh.triangles {
            let [p, q, r] = [a, b, c].map(|i| cloud.points_m[i as usize]);
            assert!(dot(cross(minus(q, p), minus(r, p)), [0.0, -1.0, 0.0]) > 0.0);
        }
    }

    #[test]
    fn a_missing_corner_costs_one_triangle_of_each_of_its_cells() {
        // An inner point has four cells; each keeps the triangle of its other three corners.
        assert_eq!(join(&MeshParams::default(), &wall(3, 3, &[(1, 1)])).triangles.len(), 4);
        assert_eq!(join(&MeshParams::default(), &wall(2, 2, &[(0, 0)])).triangles.len(), 1);
    }

    #[test]
    fn points_far_apart_are_not_joined() {
        let mut cloud = wall(4, 5, &[]);
        for (point, scan) in cloud.points_m.iter_mut().zip(&cloud.scan) {
            point[0] += if *scan >= 2 { 1.0 } else { 0.0 };
        }
        // The door between scans 1 and 2 stays open: one of three columns of cells is gone.
        assert_eq!(join(&MeshParams::default(), &cloud).triangles.len(), 2 * 2 * 4);
    }

    #[test]
    fn the_shorter_diagonal_is_taken() {
        let mut cloud = wall(2, 2, &[]);
        // Push corner (scan 0, beam 0) and its opposite outwards: the other diagonal becomes the shorter.
        cloud.points_m[0][2] = -0.1;
        cloud.points_m[3][2] = 0.2;
        let mesh = join(&MeshParams::default(), &cloud);
        assert!(mesh.triangles.iter().all(|t| t.contains(&1) && t.contains(&2)), "{:?}", mesh.triangles);
    }

    #[test]
    fn one_scan_no_point_and_equal_points_give_no_triangle() {
        assert!(join(&MeshParams::default(), &Cloud::default()).triangles.is_empty());
        assert!(join(&MeshParams::default(), &wall(1, 9, &[])).triangles.is_empty());
        let mut same = wall(3, 3, &[]);
        same.points_m.fill([1.0, 1.0, 1.0]);
        assert!(join(&MeshParams::default(), &same).triangles.is_empty());
        let mut broken = wall(3, 3, &[]);
        broken.points_m.fill([f32::NAN; 3]);
        assert!(join(&MeshParams::default(), &broken).triangles.is_empty());
    }
}
